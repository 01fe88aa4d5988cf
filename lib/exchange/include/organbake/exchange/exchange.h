// SPDX-License-Identifier: GPL-3.0-or-later
// A bundle for other programs: its surface with textures, pictures cut out of their ground, and a
// page that plays it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"
#include "organbake/exchange/exports.h"
#include "organbake/formats/camera_files.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// The surface as a bundle's base layer has it, at rest and in its colours: every node counted once,
// so that it is closed where the shell is. The bundle's maps are not asked for. Throws BadDataError
// when the layer is not of the bundle's shell.
TriangleMesh base_surface(const Bundle& bundle);

// What the maps of a bundle show at a place of its surface.
struct MapSample {
  Eigen::Vector3f color;   // linear
  Eigen::Vector3d normal;  // unit, of the surface as fine as the maps have it
};

// Reads colours and normals at places of the surface from all maps that show them, between their
// texels; those that see a place more from the front and with more confidence count for more.
// All maps must have been read. Thread-safe after construction.
class MapSampler {
 public:
  explicit MapSampler(const Bundle& bundle);

  // normal: the surface's, roughly. Nothing where no map shows the place.
  std::optional<MapSample> at(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal) const;
  // The median size of what a texel shows, over all maps.
  double texel_mm() const { return texel_mm_; }

 private:
  const Bundle& bundle_;
  std::vector<std::vector<Eigen::Vector3f>> normals_;  // of each camera's texels; zero: none
  double texel_mm_ = 1;
};

// Points of the surface for those who start from a sparse model: places that a camera's map has
// (exact but for the depth's rounding), spread to at least spacing_mm by a grid, at most about
// `most` of them, in the maps' colours. Each is told for every camera whose map shows that place.
// All maps must have been read. The same for any number of threads.
std::vector<SparsePoint> surface_points(const Bundle& bundle, double spacing_mm,
                                        std::size_t most = 100000);

struct TexturedSurfaceOptions {
  std::size_t faces = 10000;  // at most; 0 = all of the base layer's
  int texture_side = 2048;    // texels, 64…8192; 0 = as many as the maps are fine
  // Colours freed from the light that they were baked in, for viewers that light anew; needs a
  // bundle that knows its light.
  bool albedo = false;

  void check() const;  // throws UsageError
};

// A bundle's surface at rest for programs that draw with a GPU: reduced to a number of faces, laid
// flat in charts, in one atlas of the maps' colours and of their normals, whose edges are padded so
// that filters find the surface's own colours. Where no map shows the surface the base layer does.
// All maps must have been read. The same for any number of threads. Throws UsageError when albedo
// is asked of a bundle that does not know its light.
TexturedMesh textured_surface(const Bundle& bundle, const TexturedSurfaceOptions& options,
                              const RunContext& context = {});

// What one camera of a bundle sees, cut out of its ground.
struct CutOut {
  Rgb8Image color;                  // sRGB, not multiplied by alpha; black where alpha is 0
  std::vector<std::uint8_t> alpha;  // how much of the pixel the organ covers
  std::vector<float> depth_mm;      // planar z; 0 where the pixel's centre sees nothing
};

// Colours and depths are the maps'. The outline is the base layer's, over 4 × 4 rays a pixel; what
// the maps leave out beside it (they keep nothing that they see at a grazing angle) is filled from
// there, so that the organ ends where its surface does. base: base_surface() of the bundle, `scene`
// its search tree. Spreads over TBB's threads.
CutOut cut_out(const CameraMaps& maps, const PosedCamera& camera, const TriangleMesh& base,
               const RayScene& scene);

// White where the organ covers at least half of a pixel: an 8-bit PNG.
std::string mask_png(const CutOut& picture);
// Whole counts of unit_mm in 16 bits, 0 for nothing.
std::string depth_png(const CutOut& picture, double unit_mm);
// The finest unit of 1, 2 or 5 · 10ⁿ mm in which that depth fits into 16 bits.
double depth_unit_mm(double largest_depth_mm);

// What a page is made of beside the organ, as it lies in share/organbake/web.
struct WebPlayer {
  // page.html, page.css, organ.js and webgl.js, painter.js, headset.js and page.js
  std::string page, style, loader, script;
  std::vector<std::byte> module, shaders;  // organ.wasm, organ.glsl
};

// Throws NoInputError for what is missing; of the module it says how it is built.
WebPlayer read_web_player(const std::filesystem::path& folder);

// One self-contained page in which the organ can be looked at and poked. Throws as web_pack() does.
std::string web_page(const Bundle& bundle, const WebPlayer& player, const RunContext& context = {});

// A bundle as the player in a page reads it (bundle/bundle_pack.h), the same bytes for any number
// of threads. Throws BadDataError for a bundle too large for it, CancelledError.
std::vector<std::byte> web_pack(const Bundle& bundle, const RunContext& context = {});

}  // namespace organbake
