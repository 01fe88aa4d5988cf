// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
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

  // Throws UsageError.
  void check() const;
};

// The paper's silicone organ as synthetic truth: a lumpy closed organ with fine bumps, and a
// texture of known formula (organ_shape.h, organ_texture.h). The outline fills the same share of
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

}  // namespace organbake
