// SPDX-License-Identifier: GPL-3.0-or-later
#include "texel_tile.h"

#include <cmath>

#include "depth_edges.h"

namespace organbake {
namespace {

// Points to be shaded together; those of one texel stand side by side.
struct ColorBatch {
  std::vector<Eigen::Vector3d> points, normals;
  std::vector<RayHit> hits;
  std::vector<std::size_t> texels;
  std::vector<Eigen::Vector3f> colors;

  void add(const SmoothNormals& surface, const Ray& ray, const RayHit& hit, std::size_t texel) {
    points.push_back(ray.origin + hit.t * ray.direction);
    normals.push_back(surface.at(hit));
    hits.push_back(hit);
    texels.push_back(texel);
  }

  void average_into(std::vector<Eigen::Vector3f>& map) const {
    for (std::size_t first = 0, last; first < texels.size(); first = last) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (last = first; last < texels.size() && texels[last] == texels[first]; ++last)
        sum += colors[last];
      map[texels[first]] = sum / static_cast<float>(last - first);
    }
  }
};

std::vector<Ray> rays_of(const std::vector<CenterHit>& centers, const CameraRays& camera,
                         int side) {
  std::vector<Ray> rays;
  rays.reserve(centers.size() * side * side);
  for (const CenterHit& center : centers)
    for (int row = 0; row < side; ++row)
      for (int column = 0; column < side; ++column)
        rays.push_back(
            camera.through(center.x + (column + 0.5) / side, center.y + (row + 0.5) / side));
  return rays;
}

// Most rays meet the very face that the texel's centre met; only the others search the scene.
std::vector<RayHit> trace(const CaptureScene& scene, const std::vector<CenterHit>& centers,
                          const std::vector<Ray>& rays) {
  const std::size_t rays_per_texel = rays.size() / centers.size();
  std::vector<RayHit> hits(rays.size());
  std::vector<std::size_t> open;
  std::vector<Ray> open_rays;
  for (std::size_t r = 0; r < rays.size(); ++r) {
    const std::uint32_t face = centers[r / rays_per_texel].hit.face;
    if (scene.normals.crosses(face, rays[r], hits[r])) continue;
    open.push_back(r);
    open_rays.push_back(rays[r]);
  }
  std::vector<RayHit> open_hits(open.size());
  scene.rays.first_hits(open_rays, open_hits);
  for (std::size_t i = 0; i < open.size(); ++i) hits[open[i]] = open_hits[i];
  return hits;
}

}  // namespace

void color_texels(const CaptureScene& scene, const CameraRays& camera,
                  const std::vector<CenterHit>& centers, CameraMaps& maps) {
  if (centers.empty()) return;
  const std::vector<Ray> rays = rays_of(centers, camera, scene.rays_per_side);
  const std::vector<RayHit> hits = trace(scene, centers, rays);
  const std::size_t rays_per_texel = rays.size() / centers.size();

  ColorBatch batch;
  for (std::size_t c = 0; c < centers.size(); ++c) {
    const RayHit& center = centers[c].hit;
    const std::size_t texel = std::size_t(centers[c].y) * maps.width + centers[c].x;
    const double one_surface = kSteepestDepth * center.t / camera.focal_px();
    const std::size_t before = batch.points.size();
    for (std::size_t r = c * rays_per_texel; r < (c + 1) * rays_per_texel; ++r)
      if (hits[r].face != kNoHit && std::abs(hits[r].t - center.t) <= one_surface &&
          scene.normals.faces_against(hits[r].face, rays[r].direction))
        batch.add(scene.normals, rays[r], hits[r], texel);
    if (batch.points.size() == before)  // a sliver thinner than the rays' spacing
      batch.add(scene.normals, camera.through(centers[c].x + 0.5, centers[c].y + 0.5), center,
                texel);
  }
  scene.color.shade(batch.points, batch.normals, batch.hits, batch.colors);
  batch.average_into(maps.color);
}

}  // namespace organbake
