// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The paper's silicone organ as a formula: its CT, its surface, and photographs of it under a
// studio's lights or by a single lamp.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/bundle/lighting.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/volume/volume.h"

namespace organbake {

struct OrganPhantomOptions {
  std::uint64_t seed = 1;
  std::array<int, 3> ct_size = {256, 256, 96};  // voxels, 8…2048
  Eigen::Vector3d spacing_mm = {1, 1, 3};       // the paper's scan
  double noise_hu = 10;                         // standard deviation, 0…500
  int photo_count = 8;
  int photo_size = 1024;  // pixels, square
};

// The paper's silicone organ as synthetic truth: a lumpy closed organ with fine bumps, and a
// texture of known formula. The outline fills the same share of
// any CT; bumps and texture keep their size in mm. Copies are cheap and share what was computed;
// all members may be called from several threads.
class OrganPhantom {
 public:
  explicit OrganPhantom(const OrganPhantomOptions& options);

  // > 0 inside, < 0 outside, zero on the surface; mm along the radius, so about a distance near it.
  double inside(const Eigen::Vector3d& world_mm) const;
  // Unit outward normal near the surface.
  Eigen::Vector3d normal(const Eigen::Vector3d& world_mm) const;
  // Frozen texture: linear RGB in 0…1.
  Eigen::Vector3f albedo(const Eigen::Vector3d& world_mm) const;

  // int16 HU: 60 inside, −1000 outside, partial volume at the surface, Gaussian noise.
  Volume scan(const RunContext& context = {}) const;
  // 20 · 4^subdivisions faces (0…9), every vertex on the formula's surface, coloured as the
  // photographs show it but for the highlights. Throws UsageError.
  TriangleMesh surface(int subdivisions = 7, const RunContext& context = {}) const;
  // photo_count cameras (none at 0) all round, the whole organ in each frame.
  std::vector<PosedCamera> photo_cameras() const;
  // Lambert + specular under the studio's fixed lights, 2×2 rays a pixel, linear → sRGB, black
  // background.
  Rgb8Image photograph(const PosedCamera& camera, const RunContext& context = {}) const;

 private:
  struct Impl;
  OrganPhantomOptions options_;
  std::shared_ptr<const Impl> impl_;
};

// The studio's lights, fixed in the world (LPS) so that every photograph shows the same shading:
// a warm key from the front, right and above, a cool fill from behind on the left, and an ambient
// that is brighter from above; the sheen of moist tissue and the glints of the film on it.
const Lighting& studio_lighting();

// The only light of a photograph, in camera axes. It casts no shadow beyond the side that it
// doesn't face, as most renderers draw it.
struct PhotoLight {
  Eigen::Vector3d lamp_camera_mm = Eigen::Vector3d::Zero();  // where the lamp sits
  double falloff = 2;        // power of the distance by which it weakens; 0: not at all
  double beam_exponent = 0;  // of the cosine to the optical axis; 0: the same all round
  // Set: far away instead, in this direction (surface → light), with some ambient light.
  std::optional<Eigen::Vector3d> toward;
  double ambient = 0.2;  // share of the light, for `toward`
};

// The phantom as an endoscope sees it: the only lamp sits at the camera's centre,
//   L = albedo · cos θ / r² + highlights,
// r the distance to the camera, θ the angle between the normal and the way there; or where `light`
// says.
struct LampScene {
  bool textured = false;    // the organ's albedo; else white
  bool highlights = false;  // Blinn (1977), exponent 180: the wet film's glints
  PhotoLight light = {};
};

// Linear radiance, 1 for white skin that faces the lamp at the organ's centre's distance; several
// rays to a pixel, each refined to the formula's surface.
struct LampPicture {
  int width = 0, height = 0;
  std::vector<Eigen::Vector3f> radiance;
};
LampPicture picture_by_lamp(const OrganPhantom& phantom, const TriangleMesh& near_surface,
                            const PosedCamera& camera, const LampScene& scene,
                            const RunContext& context = {});

// The same of a mesh with smooth normals: for organs without a formula, and for questions in which
// the error that a mesh makes of the formula has no place. `albedo` of a surface point (world mm)
// where the scene is textured.
using AlbedoAt = std::function<Eigen::Vector3d(const Eigen::Vector3d& world_mm)>;
LampPicture picture_of_mesh_by_lamp(const TriangleMesh& mesh, const PosedCamera& camera,
                                    const LampScene& scene = {}, const AlbedoAt& albedo = {},
                                    const RunContext& context = {});

// How a sensor turns radiance into 8-bit sRGB. All in shares of its linear range.
struct Sensor {
  double gain = 0.6;
  double offset = 0.1;  // far enough from black that the noise is not clipped there
  double noise = 0.02;  // standard deviation, the same in all three channels of a pixel
  double vignette = 0;  // light lost in the picture's corners, falling with the radius squared
  std::uint64_t seed = 1;
};
Rgb8Image develop(const LampPicture& picture, const Sensor& sensor);

}  // namespace organbake
