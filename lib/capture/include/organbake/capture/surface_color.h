// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Where the colour of a surface's points comes from: its own vertices, a tissue by name, a
// photograph of such tissue, or posed photographs of the very organ.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "organbake/bundle/lighting.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// `plain` is noise of two sizes on one albedo, matt; the others are what a scope shows of organs.
enum class Tissue : std::uint8_t {
  plain,
  liver,
  gallbladder,
  spleen,
  kidney,
  stomach,
  bowel,
  fat,
  silicone
};

// Vessels that branch and taper along a tissue's surface, and come and go.
struct TissueVessels {
  Eigen::Vector3f color = Eigen::Vector3f::Zero();  // linear
  double spacing_mm = 10, width_mm = 0.4;           // of twigs, about; of the widest
  double share = 0;                                 // of the surface on which they show, 0…1
  double cover = 0;                                 // of the colour below, 0…1
};

// How one tissue looks. Albedo varies by slow mottles of brightness and of tint, and by a grain.
struct TissueLook {
  Eigen::Vector3f albedo;      // linear, 0…1: the median
  Eigen::Vector3f tint;        // what mottles of colour multiply by 1 ± of, standard deviations
  double mottle = 0;           // standard deviation of the slow brightness, as a share
  double mottle_mm = 10;       // its size
  double seams = 0;            // 0…1: how much darker it is between lobules, mottle_mm apart
  Eigen::Vector3f grain;       // linear, added where the grain is brightest, taken where darkest
  double grain_mm = 1;         // of the largest grains
  TissueVessels large, small;  // small ones lie below
  std::vector<Lighting::Lobe> gloss;
  SkinFinish finish;
  double exposure = 1;  // ScopeLight::gain, as a camera sees it among other tissue
};

// Of any but Tissue::plain. Where each colour comes from stands beside it.
const TissueLook& tissue_look(Tissue tissue);

// A photograph of the tissue that a surface without colours shall get.
struct ExemplarPhoto {
  Rgb8Image image;
  std::vector<std::uint8_t> mask;  // of the image's size, 0 where it is not that tissue; empty: all
  double mm_per_pixel = 0;         // on the tissue, 0.001…10
};

// A tissue that a photograph shows: of its mask's pixels that are neither dark nor white.
struct ShownTissue {
  double share = 0;
  Eigen::Vector3f color = Eigen::Vector3f::Zero();  // the mean, linear
};
// The largest first; more than one where red over green differs as between a liver and fat, over a
// twentieth of the pixels or more. Tissues of like hue are not told apart.
std::vector<ShownTissue> tissues_shown(const ExemplarPhoto& photo);

// The photograph's tissue without its light and its highlights, as what histogram-preserving
// blending needs (Heitz and Neyret 2018): along each axis of its colours' principal components the
// values are ranked and replaced by those of a normal distribution, whose blends keep their
// variance when divided by ‖weights‖; a table brings what was blended back.
class Exemplar {
 public:
  // Throws UsageError for the scale, BadDataError for a mask of another size or for a photograph
  // with less tissue than kLeastTissue_px in one piece: all highlight, black, too small.
  explicit Exemplar(const ExemplarPhoto& photo);

  // Squares of tissue are cut out round these places, at most `reach_mm` to each side.
  double reach_mm() const { return reach_px_ * mm_per_pixel_; }
  std::size_t place_count() const { return places_.size(); }
  // The normal scores there, interpolated; from_place_mm within ± reach_mm.
  Eigen::Vector3f scores(std::size_t place, const Eigen::Vector2d& from_place_mm) const;
  // Of blended scores: linear colour, ≥ 0.
  Eigen::Vector3f color(const Eigen::Vector3f& scores) const;

  // What the tissue's pixels are without light, before any blending; for measuring.
  const std::vector<Eigen::Vector3f>& tissue() const { return tissue_; }
  double highlight_share() const { return highlight_share_; }  // of the mask's pixels

  static constexpr int kLeastTissue_px = 1024;

 private:
  void keep(const ExemplarPhoto& photo, std::vector<std::uint8_t>& usable);
  void take_light_out(const std::vector<std::uint8_t>& usable);
  void find_places(const std::vector<std::uint8_t>& usable);
  void make_scores(const std::vector<std::uint8_t>& usable);

  static constexpr int kTable = 512;

  int width_ = 0, height_ = 0;
  double mm_per_pixel_ = 1, reach_px_ = 0, highlight_share_ = 0;
  std::vector<Eigen::Vector3f> pixels_;  // colours at first, then scores
  std::vector<Eigen::Vector3f> tissue_;
  std::vector<std::array<int, 2>> places_;  // x, y
  Eigen::Vector3f mean_ = Eigen::Vector3f::Zero();
  Eigen::Matrix3f axes_ = Eigen::Matrix3f::Identity();
  std::array<std::array<float, kTable + 1>, 3> table_{};  // by score, −kWidest…kWidest
};

struct Photo {
  PosedCamera camera;
  Rgb8Image image;
};

// A material for surfaces without photographs, lit from one side: a tissue by name, or plain albedo
// varied by solid noise:
//   color = albedo · (1 + 2 variation · noise) · (ambient + (1 − ambient) max(0, n·l))
// with noise of two sizes, feature_mm and feature_mm / 2.6, seldom beyond ±0.5.
struct Material {
  Tissue tissue = Tissue::plain;  // another one brings its own albedo, variation and features
  Eigen::Vector3f albedo = {0.42f, 0.13f, 0.10f};       // linear, 0…1
  float variation = 0.25f;                              // of the albedo, 0…1
  float feature_mm = 6;                                 // size of the largest spots, 0.01…1000
  Eigen::Vector3d light_direction = {-0.3, -0.8, 0.5};  // surface → light, world, any length
  float ambient = 0.35f;                                // share of the light, 0…1

  // Of a tissue by name with the light at the scope, in which it is meant to be seen.
  Lighting lighting() const;
  // Throws UsageError; also for an albedo, variation or feature of a tissue that has its own.
  void check() const;
};

// The colour of points of one surface. Implementations are thread-safe.
class SurfaceColor {
 public:
  virtual ~SurfaceColor() = default;
  // The size of the smallest spots, mm: over a quarter of it the colour hardly changes. 0: any.
  virtual double detail_mm() const { return 0; }
  // Scene-linear colours at surface points (mm, world) on the given faces with unit normals; the
  // three inputs have one length, which colors is set to.
  virtual void shade(const std::vector<Eigen::Vector3d>& points,
                     const std::vector<Eigen::Vector3d>& normals, const std::vector<RayHit>& hits,
                     std::vector<Eigen::Vector3f>& colors) const = 0;
};

// From posed photographs: a photo counts where it sees the point unoccluded, weighted by incidence,
// resolution and the distance to its border and to outlines in it; where none does, the nearest
// seen surface's colours are carried over. `surface` is used here only. Throws
// BadDataError when there is no photo, an image is not of its camera's size, or none sees the
// surface.
std::unique_ptr<SurfaceColor> make_photo_color(const TracedSurface& surface,
                                               std::vector<Photo> photos);
// The surface's own colours, interpolated. Throws BadDataError when it has none.
std::unique_ptr<SurfaceColor> make_vertex_color(const TriangleMesh& surface);
// Throws UsageError.
std::unique_ptr<SurfaceColor> make_material_color(const Material& material);
// A photograph's tissue in the material's light; of the material itself only its gloss and finish
// count. The plain one, which has none, gets a wet liver's.
struct ExemplarLook {
  std::unique_ptr<SurfaceColor> color;
  Lighting lighting;
};
// Throws UsageError, or BadDataError for a photograph without enough tissue.
ExemplarLook make_exemplar_color(const ExemplarPhoto& photo, Material material);

// The surface with the colours that the maps show at its vertices, so that it can be compared with
// what is played. Edges longer than finest_mm are halved first, for colours as fine as the maps';
// 0 leaves them. Throws UsageError when finest_mm would take more faces than make sense.
TriangleMesh colored_surface(const TracedSurface& surface, const SurfaceColor& color,
                             double finest_mm);

// One posed photograph and what it sees of a surface. Every factor of the weight is continuous over
// the surface, so that colours blended by it have no seams:
//   facing      cos² of the incidence, faded out below cos = 0.4 … 0.2
//   border      faded out over the frame's last 8 %: a close-up ends in the middle of a surface
//   outlines    0 within 1.5 texels of a depth edge in the photo (there its pixels mix two
//               surfaces, or the background), 1 from 5 texels on; texels of a depth map of at most
//               512, as coarse as or coarser than the photo
//   occlusion   1 where the point's depth is the depth map's, 0 where it lies behind
//   resolution  (focal length / depth)², 1 at the middle of the surface
// The depth map stands in for shadow rays: it costs a lookup instead of a traversal, and a ray's
// yes or no would leave a seam round every shadow.
class PhotoView {
 public:
  // Throws BadDataError when the image's size is not the camera's.
  PhotoView(Photo photo, const TracedSurface& surface);

  // The photo's colour of a point, linear. Weight 0 when the photo does not see it.
  struct Look {
    float weight = 0;
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
  };
  Look look_at_point(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;

 private:
  void trace_depth(const TracedSurface& surface);
  double seen(const Eigen::Vector2d& pixel, double depth) const;
  Eigen::Vector3f linear_color(const Eigen::Vector2d& pixel) const;

  Photo photo_;
  Eigen::Vector3d eye_;
  double middle_depth_;
  int map_width_ = 0, map_height_ = 0;
  double map_per_pixel_ = 1, map_focal_px_ = 1;
  struct Seen {
    float depth_mm;  // +inf = background
    float clear;     // 0…1: how far from an outline
  };
  std::vector<Seen> map_;
};

}  // namespace organbake
