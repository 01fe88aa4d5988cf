// SPDX-License-Identifier: GPL-3.0-or-later
#include "color/color_silhouette.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/text.h"
#include "pose/pose_quality.h"

namespace organbake {
namespace {

// Of cover and likelihood, each pixel by how much it tells.
double correlation(const ColorScene& scene, const std::vector<float>& cover,
                   const std::vector<float>& likely) {
  double n = 0, c = 0, l = 0, cc = 0, ll = 0, cl = 0;
  for (std::size_t i = 0; i < cover.size(); ++i) {
    const double w = scene.level.valid[i] ? telling(likely[i]) : 0;
    n += w;
    c += w * cover[i];
    l += w * likely[i];
    cc += w * cover[i] * cover[i];
    ll += w * likely[i] * likely[i];
    cl += w * cover[i] * likely[i];
  }
  n = std::max(n, 1e-9);
  const double spread = (cc - c * c / n) * (ll - l * l / n);
  return spread > 0 ? (cl - c * l / n) / std::sqrt(spread) : 0;
}

// Of the pixels that the organ covers, the share whose colour is likely its own, of those that
// tell.
double share_of_own(const ColorScene& scene, const std::vector<float>& cover,
                    const std::vector<float>& likely) {
  double own = 0, all = 0;
  for (std::size_t i = 0; i < cover.size(); ++i) {
    if (!scene.level.valid[i]) continue;
    const double w = double(telling(likely[i])) * cover[i];
    all += w;
    own += likely[i] > 0.5f ? w : 0;
  }
  return all > 0 ? own / all : 0;
}

double share_telling(const ColorScene& scene, const std::vector<float>& cover,
                     const std::vector<float>& likely) {
  double tells = 0, all = 0;
  for (std::size_t i = 0; i < cover.size(); ++i) {
    all += cover[i];
    if (scene.level.valid[i]) tells += double(telling(likely[i])) * cover[i];
  }
  return all > 0 ? tells / all : 0;
}

// Pixels on either side of the outline and near it: how many tell, and how many of these have the
// colours of their side.
void check_sides(const RegisteredSurface& surface, const ColorScene& scene,
                 const SilhouetteFit& fit, const std::vector<float>& cover, PoseQuality& quality) {
  constexpr double kNear_px = 2;
  constexpr float kBeside = 0.02f;  // of the cover, blurred by so many pixels: within four of them
  constexpr float kTells = 0.25f, kSide = 0.25f;
  const std::vector<float> soft = covered(surface, scene.level, fit.pose, kNear_px);
  double places = 0, asked = 0, confirmed = 0;
  for (std::size_t i = 0; i < cover.size(); ++i) {
    const bool on_it = std::abs(cover[i] - 0.5f) < kSide;  // of two colours
    if (soft[i] < kBeside || soft[i] > 1 - kBeside || on_it) continue;
    ++places;
    if (!scene.level.valid[i] || telling(fit.likely[i]) < kTells) continue;
    ++asked;
    confirmed += (fit.likely[i] > 0.5f) == (cover[i] > 0.5f);
  }
  quality.outline_asked_share = places > 0 ? asked / places : 0;
  quality.outline_share = asked > 0 ? confirmed / asked : 0;
}

void judge(PoseQuality& q) {
  constexpr double kLeastCorrelation = 0.8, kLeastVisible = 0.4, kLeastOutline = 0.75;
  const auto percent = [](double share) { return to_text(100 * share, 0) + " %"; };
  q.verdict = Verdict::failed;
  if (!(q.correlation >= kLeastCorrelation)) {
    q.reason = "no colours of the photograph draw the surface's silhouette: R = " +
               to_text(q.correlation, 3);
  } else if (!(q.visible_share >= kLeastVisible)) {
    q.reason = "only " + percent(q.visible_share) + " of the silhouette has colours of its own, " +
               percent(kLeastVisible) + " are needed";
  } else if (!(q.outline_share >= kLeastOutline)) {
    q.reason =
        "the colours have the outline elsewhere: " + percent(q.outline_share) + " of it fits";
  } else {
    q.verdict = Verdict::doubtful;
    q.reason = "only the silhouette was compared, by its colours, and other poses may share it";
  }
}

}  // namespace

RegisteredPhoto register_by_color(const RegisteredSurface& surface, const PhotoToRegister& photo,
                                  const RigidTransform& start, const RunContext& context) {
  RegisteredPhoto result;
  result.light = LightModel::automatic;  // none is needed
  result.camera.intrinsics = photo.intrinsics;
  result.camera.camera_from_world = start;
  const ObjectPose first = object_pose(start, surface.center());
  result.quality.reason = "the start has the organ out of the picture";
  if (!in_front(surface, first)) return result;
  const ColorScene scene = ColorScene::around(surface, photo, first);
  const SilhouetteFit fit = fit_silhouette(surface, scene, first, context);
  if (!fit.usable) {
    if (!fit.likely.empty())
      result.quality.reason =
          "no colours of the photograph draw the surface's silhouette near the start";
    return result;
  }
  const std::vector<float> cover = covered(surface, scene.level, fit.pose, 0);
  PoseQuality& quality = result.quality;
  quality.correlation = correlation(scene, cover, fit.likely);
  quality.inlier_share = share_of_own(scene, cover, fit.likely);
  quality.visible_share = share_telling(scene, cover, fit.likely);
  check_sides(surface, scene, fit, cover, quality);
  measure_spread(surface, silhouette_curvature(surface, scene, fit), fit.pose, quality);
  judge(quality);
  result.camera.camera_from_world = rigid_transform(fit.pose, surface.center());
  return result;
}

}  // namespace organbake
