// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/material_picture.h"

#include "organbake/capture/traced_surface.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr int kRaysPerSide = 4, kRaysPerPixel = kRaysPerSide * kRaysPerSide;

std::vector<Ray> rays_of_row(const PosedCamera& camera, int y) {
  const CameraRays through(camera);
  std::vector<Ray> rays;
  rays.reserve(std::size_t(camera.intrinsics.width) * kRaysPerPixel);
  const auto at = [](int pixel, int ray) { return pixel + (ray + 0.5) / kRaysPerSide; };
  for (int x = 0; x < camera.intrinsics.width; ++x)
    for (int k = 0; k < kRaysPerPixel; ++k)
      rays.push_back(through.through(at(x, k % kRaysPerSide), at(y, k / kRaysPerSide)));
  return rays;
}

}  // namespace

MaterialTruth::MaterialTruth(const TriangleMesh& surface)
    : rays_(surface), normals_(surface), color_(make_material_color({})) {}

MaterialPicture MaterialTruth::draw(const PosedCamera& camera) const {
  const auto [width, height] = std::pair(camera.intrinsics.width, camera.intrinsics.height);
  MaterialPicture picture{{width, height}, std::vector<std::uint8_t>(std::size_t(width) * height)};
  parallel_for(0, height, [&](int y) { draw_row(camera, y, picture); });
  return picture;
}

void MaterialTruth::draw_row(const PosedCamera& camera, int y, MaterialPicture& picture) const {
  const std::vector<Ray> rays = rays_of_row(camera, y);
  std::vector<RayHit> hits(rays.size());
  rays_.first_hits(rays, hits);
  std::vector<std::size_t> pixel_of;
  std::vector<RayHit> seen;
  std::vector<Eigen::Vector3d> points, normals;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].face == kNoHit) continue;
    pixel_of.push_back(i / kRaysPerPixel);
    seen.push_back(hits[i]);
    points.push_back(normals_.point(hits[i]));
    normals.push_back(normals_.at(hits[i]));
  }
  std::vector<Eigen::Vector3f> colors;
  color_->shade(points, normals, seen, colors);
  std::vector<Eigen::Vector3f> mean(camera.intrinsics.width, Eigen::Vector3f::Zero());
  for (std::size_t i = 0; i < seen.size(); ++i) mean[pixel_of[i]] += colors[i] / kRaysPerPixel;
  const std::size_t first = std::size_t(y) * camera.intrinsics.width;
  for (const std::size_t x : pixel_of) picture.covered[first + x] = 1;
  for (std::size_t x = 0; x < mean.size(); ++x) {
    for (int c = 0; c < 3; ++c)
      picture.color.pixels[3 * (first + x) + c] = srgb8_from_linear(mean[x][c]);
  }
}

}  // namespace organbake
