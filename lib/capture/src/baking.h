// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What capture() and bake_smooth_skin() are made of: meetings of the shell's lines with the
// surface, tiles of maps and their edges, the base layer, thin plates. And what the colours of a
// surface are made of: colours led on to where none is known, a photograph's tissue, noise and
// vessels.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/bundle.h"
#include "organbake/capture/solid_noise.h"
#include "organbake/capture/surface_color.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// How far from the proxy the shell must reach: some surface points' distances tell, with room for
// points between them and for shell lines that lean. A point beyond is bound to the nearest face.
double shell_reach_mm(const TriangleMesh& surface, const TriangleMesh& proxy);

// Where shell lines meet the surface: of all meetings within reach_mm of the foot, both ways, the
// nearest whose normal agrees with the line; where there is none, the closest surface point. A
// hit's t is the height over the foot, in lengths of the line's direction.
std::vector<RayHit> shell_hits(const std::vector<Lattice::ShellLine>& lines,
                               const TracedSurface& surface, double reach_mm,
                               const RunContext& context);

// Two texels side by side lie on one surface when their depths differ by at most this many texel
// widths (depth / focal length in pixels): a plane seen 80° from facing.
inline constexpr double kSteepestDepth = 5.67;

// Distance, in texels, from each texel's centre to the nearest depth edge: a jump between
// neighbours that kSteepestDepth does not explain, an outline against the background, or the
// image's border. At most `reach`; 0 for background. Depth is planar, +inf = background.
std::vector<float> depth_edge_distance(std::span<const float> depth_mm, int width, int height,
                                       double focal_px, double reach);

inline constexpr int kTileSide = 16;  // texels: coherent rays, and enough of them to share out

// What one capture works on.
struct CaptureScene {
  const TracedSurface& surface;
  const ShellBinder& shell;
  const SurfaceColor& color;
  int rays_per_side;
};

struct TileCounts {
  std::size_t in_prism = 0, by_fallback = 0, unbound = 0, back_faces = 0;
  double largest_height_mm = 0;
};

// Fills the texels of one tile: depth at their centres, colour, face and height; confidence holds
// the incidence alone until fade_at_edges, where it is 0 they have a depth alone.
TileCounts capture_tile(const CaptureScene& scene, const PosedCamera& camera, int left, int top,
                        CameraMaps& maps);

// Lowers the confidence of texels near a depth edge, where cameras disagree. Texels that have none
// become background: nobody draws them. Returns how many did.
std::size_t fade_at_edges(const Intrinsics& intrinsics, CameraMaps& maps);

// Leads the colours some texels on beyond the outline. Nobody draws them: a program in which a map
// is painted or made smaller then mixes no black into the rim.
void lead_colors_beyond_outline(CameraMaps& maps);

struct BaseLayerScene {
  const TriangleMesh& proxy;
  const TracedSurface& surface;
  const SurfaceColor& color;
  const std::vector<PosedCamera>& cameras;
  const std::vector<CameraMaps>& maps;  // finished
  double reach_mm;                      // along a shell line, both ways
};

// A place on a surface and the surface's direction there, a unit vector.
struct DirectedPlace {
  Eigen::Vector3d at_mm, normal;
};

// Where places lie for a plate: along the directions in which those that it runs through spread
// and, beyond what follows from those, their normals. r³ is only fit for interpolation together
// with all affine functions of the space that r is measured in, and those need places that spread
// in all of it.
class PlateSpace {
 public:
  PlateSpace() = default;
  // twist_mm: what a turn of 1 rad counts as.
  PlateSpace(const std::vector<DirectedPlace>& through, const DirectedPlace& center,
             double twist_mm);

  Eigen::Index dimensions() const { return place_axes_.rows() + normal_axes_.rows(); }
  Eigen::VectorXd operator()(const DirectedPlace& place) const;

 private:
  DirectedPlace center_;
  Eigen::MatrixXd place_axes_, normal_axes_, place_in_normal_;
};

// A thin plate (Duchon 1977) through some places of a surface, the first of which it is about.
class ThinPlate {
 public:
  ThinPlate() = default;
  // reach_mm: how far it counts.
  ThinPlate(const std::vector<DirectedPlace>& through, double twist_mm, double reach_mm);

  // Fades from 1 to 0 at the plate's reach, twice continuously differentiable (Wendland 1995).
  double share(const DirectedPlace& place) const;
  // Of what it runs through, in that order; they sum to 1.
  Eigen::VectorXd weights(const DirectedPlace& place) const;

 private:
  Eigen::VectorXd functions(const Eigen::VectorXd& place) const;
  void solve();

  DirectedPlace center_;
  double twist_mm_ = 0, reach_mm_ = 0, size_mm_ = 0;
  PlateSpace space_;
  std::vector<Eigen::VectorXd> through_;  // in the plate's space, in sizes
  Eigen::MatrixXd inverse_;
};

// Carries colours over a mesh from the vertices that have one (known ≠ 0) to all others: each takes
// the mean of the neighbours nearer to a known one, then the carried colours are smoothed. Pieces
// without any known vertex take the mean of all known ones. Throws BadDataError when none is known.
void flood_colors(const TriangleMesh& mesh, const std::vector<char>& known,
                  std::vector<Eigen::Vector3f>& colors);

// The exemplar anywhere on a surface: three cells of a triangle grid on each of three planes, each
// cell from a place of its own that is hashed from the cell, blended by the squares of their
// shares, the planes by the normal (Burley 2019 has the grid, the planes as usual). The same
// colours for any threads.
class ExemplarTexture {
 public:
  explicit ExemplarTexture(Exemplar exemplar);

  // point: world mm; normal: unit. Linear.
  Eigen::Vector3f at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  const Exemplar& exemplar() const { return exemplar_; }

 private:
  // Adds one plane's blend, weight · scores, and the squares of the weights.
  void add_plane(int plane, const Eigen::Vector2d& at_mm, double weight, Eigen::Vector3f& sum,
                 double& squares) const;

  static constexpr std::size_t kQuantiles = 256;

  Eigen::Vector3f blended_at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  void match_channels();

  Exemplar exemplar_;
  double side_mm_;  // of the grid's triangles
  // Of each channel: what is blended, and what the tissue has at the same quantiles.
  std::array<std::array<float, kQuantiles + 1>, 3> blended_{}, wanted_{};
};

// Vessels on a square that repeats: trees that branch and taper, grown by space colonisation
// (Runions, Lane and Prusinkiewicz 2007, "Modeling Trees with a Space Colonization Algorithm"; of
// leaves, 2005): points that want blood pull the nearest tip a step nearer, until one reaches them.
// A vessel's width follows Murray's law: the cube of a parent's is the sum of its children's.
struct VesselTreeOptions {
  double side_mm = 64;
  double spacing_mm = 6;  // between twigs, about
  double width_mm = 0.5;  // of the widest
  int trees = 3;
  std::uint64_t seed = 1;
};

// Its picture, to look up anywhere on the plane.
class VesselTile {
 public:
  explicit VesselTile(const VesselTreeOptions& options);

  // How much of the place vessels cover, 0…1; half of a vessel's border.
  float cover(const Eigen::Vector2d& place_mm) const;

 private:
  static constexpr int kSide = 1024;
  void draw(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double from_width_mm,
            double to_width_mm);

  double pixels_per_mm_;
  std::vector<float> cover_;  // kSide², rows of y
};

// The albedo of a tissue anywhere on a surface: solid noise, so that nothing repeats and no seam
// shows, hashed per cell: the same numbers for any threads.
class TissueAlbedo {
 public:
  explicit TissueAlbedo(const TissueLook& look);

  // point: world mm; normal: unit. Linear, each channel in 0…1.
  Eigen::Vector3f at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  // The size over which it hardly changes, as SurfaceColor::detail_mm().
  double detail_mm() const { return 2 * look_.grain_mm; }

 private:
  struct Vessels {
    TissueVessels look;
    SolidNoise patches;
    std::shared_ptr<const VesselTile> tile;  // none: no vessels
  };
  static Vessels make_vessels(const TissueVessels& look, std::uint64_t seed);
  static float cover_of(const Vessels& vessels, const Eigen::Vector3d& point,
                        const Eigen::Vector3d& normal);

  TissueLook look_;
  std::array<SolidNoise, 3> mottles_;
  SolidNoise tint_, grain_, fine_grain_, bend_;
  Vessels large_, small_;
};

}  // namespace organbake
