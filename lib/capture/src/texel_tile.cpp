// SPDX-License-Identifier: GPL-3.0-or-later
#include "texel_tile.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "depth_edges.h"
#include "organbake/capture/camera_rays.h"
#include "organbake/capture/smooth_step.h"
#include "organbake/image/grow.h"

namespace organbake {
namespace {

// Confidence by incidence: nothing at 80° from facing, where one texel covers six; all at 60°.
constexpr double kDarkCosine = 0.174, kSureCosine = 0.5;
// Confidence by the distance to a depth edge: all of it three texels away.
constexpr double kSureEdgeDistance = 3;

// Bits below these are noise of some thousandths of a texel and would not compress: a third of a
// map's bytes. Depth keeps 17 bits, 8·10⁻⁶ of itself; a height keeps a quarter of the depth's last
// one. Nobody sees a weight finer than 1/64.
constexpr int kDepthBits = 17, kHeightBits = 19;
constexpr float kConfidenceSteps = 64;
// How far from its texel's surface a rounded height may lead, of the depth: as far as the depth's
// last bit. Along a straight prism it is at most a quarter of that; where a body's prisms close,
// the way across the body.
constexpr double kHeightLeads = 1.0 / (1 << kDepthBits);

// `value` as a whole number of `bits` below the leading bit of `depth_mm` > 0.
float rounded_below(double depth_mm, int bits, double value) {
  int exponent = 0;
  std::frexp(depth_mm, &exponent);
  return static_cast<float>(
      std::ldexp(std::round(std::ldexp(value, bits - exponent)), exponent - bits));
}

// By the angle between surface and view.
float confidence_at(const CaptureScene& scene, const Ray& ray, const RayHit& hit) {
  const double cosine = -scene.normals.at(hit).dot(ray.direction.normalized());
  return static_cast<float>(smooth_step(kDarkCosine, kSureCosine, cosine));
}

// Depth, face and height of texels that see the surface.
void store_texels(const CaptureScene& scene, const CameraRays& camera,
                  const std::vector<CenterHit>& centers, CameraMaps& maps, TileCounts& counts) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(centers.size());
  for (const CenterHit& center : centers) {
    // A player has the depth as it is stored, so that is what must be bound.
    const Ray ray = camera.through(center.x + 0.5, center.y + 0.5);
    const float depth = rounded_below(center.hit.t, kDepthBits, center.hit.t);
    maps.depth_mm[std::size_t(center.y) * maps.width + center.x] = depth;
    points.push_back(ray.origin + double(depth) * ray.direction);
  }
  std::vector<ShellBinding> bindings(points.size());
  scene.shell.bind(points, bindings);
  for (std::size_t i = 0; i < centers.size(); ++i) {
    const ShellBinding& bound = bindings[i];
    const std::size_t texel = std::size_t(centers[i].y) * maps.width + centers[i].x;
    const float height_mm = rounded_below(centers[i].hit.t, kHeightBits, bound.height_mm);
    const double within_mm = kHeightLeads * centers[i].hit.t;
    if (!scene.shell.gives_back(bound.face, height_mm, points[i], within_mm)) {
      maps.confidence[texel] = 0;
      ++counts.unbound;
      continue;
    }
    ++(scene.shell.inside(bound, points[i]) ? counts.in_prism : counts.by_fallback);
    counts.largest_height_mm = std::max(counts.largest_height_mm, std::abs(bound.height_mm));
    maps.face[texel] = bound.face;
    maps.height_mm[texel] = height_mm;
  }
}

}  // namespace

CameraMaps background_maps(const Intrinsics& intrinsics) {
  CameraMaps maps;
  maps.width = intrinsics.width;
  maps.height = intrinsics.height;
  const std::size_t count = std::size_t(maps.width) * maps.height;
  maps.depth_mm.assign(count, std::numeric_limits<float>::infinity());
  maps.color.assign(count, Eigen::Vector3f::Zero());
  maps.height_mm.assign(count, 0);
  maps.face.assign(count, kNoFace);
  maps.confidence.assign(count, 0);
  return maps;
}

TileCounts capture_tile(const CaptureScene& scene, const PosedCamera& camera, int left, int top,
                        CameraMaps& maps) {
  const CameraRays camera_rays(camera);
  const int right = std::min(left + kTileSide, maps.width);
  const int bottom = std::min(top + kTileSide, maps.height);
  std::vector<Ray> rays;
  rays.reserve(std::size_t{kTileSide} * kTileSide);
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) rays.push_back(camera_rays.through(x + 0.5, y + 0.5));
  std::vector<RayHit> hits(rays.size());
  scene.rays.first_hits(rays, hits);

  TileCounts counts;
  std::vector<CenterHit> centers;
  std::size_t next = 0;
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x, ++next) {
      if (hits[next].face == kNoHit) continue;
      if (!scene.normals.faces_against(hits[next].face, rays[next].direction)) {
        ++counts.back_faces;
        continue;
      }
      const std::size_t texel = std::size_t(y) * maps.width + x;
      maps.confidence[texel] = confidence_at(scene, rays[next], hits[next]);
      // Of those without, till fade_at_edges has seen where the surface is.
      maps.depth_mm[texel] = static_cast<float>(hits[next].t);
      if (maps.confidence[texel] > 0) centers.push_back({x, y, hits[next]});
    }
  store_texels(scene, camera_rays, centers, maps, counts);
  color_texels(scene, camera_rays, centers, maps);
  return counts;
}

std::size_t fade_at_edges(const Intrinsics& intrinsics, CameraMaps& maps) {
  std::size_t dropped = 0;
  const double focal = std::min(intrinsics.fx, intrinsics.fy);
  const std::vector<float> distance =
      depth_edge_distance(maps.depth_mm, maps.width, maps.height, focal, kSureEdgeDistance);
  for (std::size_t i = 0; i < distance.size(); ++i) {
    const auto from_edge = static_cast<float>(smooth_step(0, kSureEdgeDistance, distance[i]));
    const float confidence = maps.confidence[i] * from_edge;
    maps.confidence[i] = std::ceil(kConfidenceSteps * confidence) / kConfidenceSteps;
    if (maps.confidence[i] > 0 || !std::isfinite(maps.depth_mm[i])) continue;
    ++dropped;
    maps.depth_mm[i] = std::numeric_limits<float>::infinity();
    maps.color[i].setZero();
    maps.height_mm[i] = 0;
    maps.face[i] = kNoFace;
  }
  return dropped;
}

void lead_colors_beyond_outline(CameraMaps& maps) {
  constexpr int kRings = 4;
  std::vector<std::uint8_t> known(maps.color.size());
  for (std::size_t i = 0; i < known.size(); ++i) known[i] = maps.confidence[i] > 0;
  grow(maps.width, maps.height, kRings, known,
       [&](std::size_t texel, std::span<const std::size_t> beside) {
         Eigen::Vector3f sum = Eigen::Vector3f::Zero();
         for (const std::size_t other : beside) sum += maps.color[other];
         maps.color[texel] = sum / static_cast<float>(beside.size());
       });
}

}  // namespace organbake
