// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints/cover_scene.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace organbake {

CoverScene::CoverScene(const TriangleMesh& surface, const OrganFrame& organ,
                       const PlacementOptions& options, const RunContext& context)
    : surface_(surface),
      organ_(organ),
      options_(options),
      context_(context),
      region_(options.region()),
      sight_(surface) {
  constexpr int kDistanceDirections = 64;
  distance_mm_ =
      organ.common_distance_mm(lattice(kDistanceDirections, LatticeKind::on_rim), options, context);
}

CoverScene::Directions CoverScene::lattice(int count, LatticeKind kind) const {
  return lattice_directions(count, region_.axis, region_.half_angle_rad, kind);
}

bool CoverScene::in_region(const Eigen::Vector3d& direction) const {
  return region_.half_angle_rad >= std::numbers::pi - 1e-9 ||
         direction.dot(region_.axis.normalized()) >= std::cos(region_.half_angle_rad) - 1e-9;
}

double CoverScene::spacing_rad(std::size_t count) const {
  return even_spacing_rad(count, region_.half_angle_rad);
}

Eigen::Vector3d CoverScene::eye_mm(const Eigen::Vector3d& direction) const {
  return organ_.center_mm() + distance_mm_ * direction;
}

SurfaceSamples CoverScene::samples(std::size_t count, std::uint64_t seed) const {
  return sample_surface(surface_, count, seed);
}

std::vector<SampleBits> CoverScene::seen_well(const Directions& cameras,
                                              const SurfaceSamples& samples,
                                              const SampleBits* among) const {
  context_.throw_if_cancelled();
  return sight_.seen_from_each(eyes(cameras, goal().texel_mm), samples, well(), among);
}

SampleBits CoverScene::reachable(const SurfaceSamples& samples) const {
  context_.throw_if_cancelled();
  return sight_.seen_from_any(eyes(lattice(kRegionViews, LatticeKind::off_rim), goal().texel_mm),
                              samples, well());
}

std::vector<SampleBits> CoverScene::visible(const Directions& cameras,
                                            const SurfaceSamples& samples) const {
  return sight_.seen_from_each(eyes(cameras, 0), samples, {});
}

Placement CoverScene::placed(const Directions& cameras) const {
  const double distance =
      std::max(distance_mm_, organ_.common_distance_mm(cameras, options_, context_));
  return placement_of(organ_, cameras, distance, options_);
}

// Focal lengths only where texels are limited: they take a look at every vertex.
std::vector<Eye> CoverScene::eyes(const Directions& directions, double texel_mm) const {
  std::vector<Eye> eyes(directions.size());
  tbb::parallel_for(std::size_t{0}, directions.size(), [&](std::size_t k) {
    eyes[k] = {eye_mm(directions[k]), -directions[k], 0};
    if (texel_mm > 0) {
      eyes[k].focal_px = organ_.camera(directions[k], distance_mm_, options_).intrinsics.fx;
    }
  });
  return eyes;
}

}  // namespace organbake
