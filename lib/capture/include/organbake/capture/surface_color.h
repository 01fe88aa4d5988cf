// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "organbake/bundle/lighting.h"
#include "organbake/capture/exemplar.h"
#include "organbake/capture/tissue_look.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

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
  double highlight_share = 0;  // of the mask's pixels, left out
  std::size_t tissue_px = 0;   // that the tissue was taken from
};
// Throws UsageError, or BadDataError for a photograph without enough tissue.
ExemplarLook make_exemplar_color(const ExemplarPhoto& photo, Material material);

}  // namespace organbake
