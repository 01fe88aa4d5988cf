// SPDX-License-Identifier: GPL-3.0-or-later
#include "cover_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

ViewingCone widened(ViewingCone cone) {
  cone.half_angle_rad = std::min(cone.half_angle_rad + kBeyondRegion_rad, std::numbers::pi);
  return cone;
}

double cap_area(const ViewingCone& cone) {
  return 2 * std::numbers::pi * (1 - std::cos(cone.half_angle_rad));
}

}  // namespace

CoverScene::CoverScene(const TriangleMesh& surface, const OrganFrame& organ,
                       const PlacementOptions& options, const RunContext& context)
    : surface_(surface),
      organ_(organ),
      options_(options),
      context_(context),
      region_(options.region()),
      stand_(widened(region_)),
      sight_(surface) {
  constexpr int kDistanceDirections = 64;
  distance_mm_ = organ.common_distance_mm(stands(kDistanceDirections), options, context);
}

CoverScene::Directions CoverScene::views(int count) const {
  return lattice_directions(count, region_.axis, region_.half_angle_rad, LatticeKind::off_rim);
}

CoverScene::Directions CoverScene::stands(int count) const {
  Directions stands =
      lattice_directions(count, region_.axis, region_.half_angle_rad, LatticeKind::on_rim);
  const double all = cap_area(stand_), beyond = all - cap_area(region_);
  if (beyond <= 0) return stands;
  const double least_cosine = std::cos(region_.half_angle_rad + spacing_rad(stands.size()) / 2);
  for (const Eigen::Vector3d& d :
       lattice_directions(static_cast<int>(0.5 * count * all / beyond), stand_.axis,
                          stand_.half_angle_rad, LatticeKind::on_rim)) {
    if (d.dot(region_.axis.normalized()) < least_cosine) stands.push_back(d);
  }
  return stands;
}

bool CoverScene::may_stand(const Eigen::Vector3d& direction) const {
  return stand_.half_angle_rad >= std::numbers::pi - 1e-9 ||
         direction.dot(stand_.axis.normalized()) >= std::cos(stand_.half_angle_rad) - 1e-9;
}

double CoverScene::spacing_rad(std::size_t count) const {
  return even_spacing_rad(count, stand_.half_angle_rad);
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

std::vector<std::uint32_t> CoverScene::missed(const Directions& cameras,
                                              const SurfaceSamples& samples,
                                              const SampleBits& among) const {
  const std::vector<SampleBits> seen = seen_well(cameras, samples, &among);
  std::vector<std::uint32_t> missed;
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    if (among.test(i) && times_in(seen, i, goal().overlap) < goal().overlap) missed.push_back(i);
  }
  return missed;
}

SampleBits CoverScene::reachable(const SurfaceSamples& samples) const {
  context_.throw_if_cancelled();
  return sight_.seen_from_any(eyes(views(kRegionViews), goal().texel_mm), samples, well());
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
  parallel_for(std::size_t{0}, directions.size(), [&](std::size_t k) {
    eyes[k] = {eye_mm(directions[k]), -directions[k], 0};
    if (texel_mm > 0) {
      eyes[k].focal_px = organ_.camera(directions[k], distance_mm_, options_).intrinsics.fx;
    }
  });
  return eyes;
}

}  // namespace organbake
