// SPDX-License-Identifier: GPL-3.0-or-later
// What is asked of a pose that depth took part in. The surface is seen where the depth lies on it;
// where something lies before it, that says nothing; where the depth lies beyond it, the surface
// cannot be there.
#include "depth/depth_verdict.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/median.h"
#include "organbake/core/text.h"
#include "pose/verdict_rule.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Bounds of the verdict, set on seeded patches with the faults of real depth, and on other organs'
// depth, so that no wrong one passes (tests/acceptance, RegistrationDepth).
constexpr double kDepthAgrees = 0.025;  // of the distance
constexpr double kDepthLeastShare = 0.35, kDepthSureShare = 0.6;
constexpr double kDepthMostPierced = 0.25, kDepthSurePierced = 0.1;
constexpr double kDepthLargestNoise = 0.0125, kDepthLargestSurfaceSd_mm = 1.0;
constexpr double kDepthLeastMargin = 0.06;
constexpr double kDepthLeastVisible = 0.1, kDepthSureVisible = 0.25;

}  // namespace

DepthFit depth_fit(const RegisteredSurface& surface, const SeenDepth& depth,
                   const DepthState& state) {
  const RigidTransform world_from_camera = rigid_transform(state.pose, surface.center()).inverse();
  DepthFit fit;
  fit.scale = std::exp(state.log_scale);
  std::vector<Ray> rays;
  for (const SeenDepth::Point& point : depth.points) {
    Ray ray;
    ray.origin = world_from_camera.translation;
    ray.direction = world_from_camera.rotation * (fit.scale * point.place);
    rays.push_back(ray);
  }
  std::vector<RayHit> hits(rays.size());
  surface.scene().first_hits(rays, hits);
  double covered = 0, agreeing = 0, pierced = 0;
  std::vector<double> off_mm;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].face == kNoHit) continue;
    ++covered;
    const double farther = hits[i].t - 1;  // the surface than what is seen, share
    pierced += farther < -kDepthAgrees;
    if (std::abs(farther) > kDepthAgrees) continue;
    ++agreeing;
    const Vector3d normal = surface.skin(hits[i], rays[i].direction).normal;
    off_mm.push_back(std::abs(farther * rays[i].direction.dot(normal)));
  }
  fit.share = agreeing / std::max(1.0, covered);
  fit.pierced_share = pierced / std::max(1.0, covered);
  fit.noise_mm = kSigmaOfMedianDeviation * median(std::move(off_mm));
  fit.noise_share = fit.noise_mm / std::max(1e-9, state.pose.center_camera_mm.z());
  return fit;
}

void judge_with_depth(PoseQuality& q) {
  const DepthFit& d = *q.depth;
  const VerdictRule rules[] = {
      {!(q.visible_share >= kDepthLeastVisible), Verdict::failed,
       "only " + percent(q.visible_share) + " of the facing surface is in the picture, " +
           percent(kDepthLeastVisible) + " are needed"},
      {!(d.share >= kDepthLeastShare), Verdict::failed,
       "the depth lies elsewhere than the surface: " + percent(d.share) + " of it fits"},
      {!(d.pierced_share <= kDepthMostPierced), Verdict::failed,
       "the surface would stand before what is seen in " + percent(d.pierced_share) +
           " of where it lies"},
      {!(q.visible_share >= kDepthSureVisible), Verdict::doubtful,
       "only " + percent(q.visible_share) + " of the facing surface is in the picture, " +
           percent(kDepthSureVisible) + " are sure"},
      {!(d.share >= kDepthSureShare), Verdict::doubtful,
       "only " + percent(d.share) + " of the surface in view lies where the depth is, " +
           percent(kDepthSureShare) + " should"},
      {!(d.pierced_share <= kDepthSurePierced), Verdict::doubtful,
       "the surface would stand before what is seen in " + percent(d.pierced_share) +
           " of where it lies"},
      {!(d.noise_share <= kDepthLargestNoise), Verdict::doubtful,
       "the depth lies " + to_text(d.noise_mm, 1) + " mm off the surface: is it this organ's?"},
      {!(d.runner_up_margin >= kDepthLeastMargin), Verdict::doubtful,
       "another pose fits the depth almost as well"},
      {!(q.surface_sd_mm <= kDepthLargestSurfaceSd_mm), Verdict::doubtful,
       "the pose is uncertain by " + to_text(q.surface_sd_mm, 2) + " mm on the surface"},
  };
  judge_by(rules, q);
}

}  // namespace organbake
