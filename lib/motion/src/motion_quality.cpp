// SPDX-License-Identifier: GPL-3.0-or-later
//
// How sure a clip's scene is. In: a scene, the pictures of its views, what another scene costs.
// Out: how its distances agree with the light of a lamp at the lens; the verdict.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/image/srgb.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
namespace {

// Scopes see 50 to 120 degrees across the picture: taken as two standard deviations to either side
// of a focal length's logarithm.
constexpr double kNarrowScope_rad = 0.8727, kWideScope_rad = 2.0944;

// Their barrel distortion draws the picture's corners in by a tenth, give or take.
constexpr double kUsualBarrel = -0.1, kUsualBarrelSd = 0.15;

}  // namespace

double focal_of_view(const Intrinsics& lens, double view_rad) {
  return 0.5 * lens.width / std::tan(0.5 * view_rad);
}

Eigen::Vector2d unlike_a_scope(const Intrinsics& lens) {
  const double longest = std::log(focal_of_view(lens, kNarrowScope_rad)),
               shortest = std::log(focal_of_view(lens, kWideScope_rad));
  const double corner = std::hypot(lens.width, lens.height) / (2 * lens.fx);
  return {(std::log(lens.fx) - 0.5 * (longest + shortest)) / (0.25 * (longest - shortest)),
          (lens.k1 * corner * corner - kUsualBarrel) / kUsualBarrelSd};
}

namespace {

// Linear light, red and green; 0 where it is overexposed or black.
Eigen::Vector2d light_at(const Rgb8Image& picture, const Eigen::Vector2d& pixel) {
  constexpr int kOfWidth = 160, kBurnt = 250;
  const int reach = std::max(1, picture.width / kOfWidth), step = std::max(1, reach / 3);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (int dy = -reach; dy <= reach; dy += step)
    for (int dx = -reach; dx <= reach; dx += step) {
      const int x = static_cast<int>(pixel.x()) + dx, y = static_cast<int>(pixel.y()) + dy;
      if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) continue;
      const std::uint8_t* color = picture.at(x, y);
      if (*std::max_element(color, color + 3) > kBurnt) return Eigen::Vector2d::Zero();
      sum += Eigen::Vector2d(linear_from_srgb8()[color[0]], linear_from_srgb8()[color[1]]);
      ++count;
    }
  return sum / std::max(1, count);
}

}  // namespace

void measure_light(const std::vector<const ClipPicture*>& views, Scene& scene) {
  parallel_for(std::size_t{0}, scene.landmarks.size(), [&](std::size_t i) {
    for (Sighting& seen : scene.landmarks[i].seen)
      if (views[seen.view] && seen.light.isZero())
        seen.light = light_at(views[seen.view]->picture.color, seen.pixel);
  });
}

namespace {

// One sighting: logarithms of the green light round it, of green by red light, and of the range
// from the lamp.
struct Lit {
  std::size_t landmark, view;
  double brightness, hue, range;
};

std::vector<Lit> lit_sightings(const Scene& scene) {
  std::vector<Lit> all;
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    const Landmark& landmark = scene.landmarks[i];
    if (!landmark.place) continue;
    for (const Sighting& seen : landmark.seen) {
      if (!seen.agrees || !scene.is_posed(seen.view) || seen.light.minCoeff() <= 0) continue;
      const double range =
          (*scene.camera_from_world[seen.view] * scene.place_in(seen.view, landmark)).norm();
      all.push_back({i, seen.view, std::log(seen.light.y()),
                     std::log(seen.light.y() / seen.light.x()), std::log(range)});
    }
  }
  return all;
}

// Takes from each figure the mean of its group.
void take_from_means(std::size_t Lit::*group, std::size_t groups, std::vector<Lit>& all) {
  std::vector<Eigen::Vector4d> sums(groups, Eigen::Vector4d::Zero());
  for (const Lit& lit : all)
    sums[lit.*group] += Eigen::Vector4d(lit.brightness, lit.hue, lit.range, 1);
  for (Lit& lit : all) {
    const Eigen::Vector4d mean = sums[lit.*group] / sums[lit.*group][3];
    lit.brightness -= mean[0];
    lit.hue -= mean[1];
    lit.range -= mean[2];
  }
}

// Variances and covariance of range and brightness. Distance changes no hue, but another tissue
// does: what goes with the hue is albedo, and left out.
Eigen::Matrix2d spread_of(const std::vector<Lit>& all) {
  Eigen::Matrix3d sums = Eigen::Matrix3d::Zero();
  for (const Lit& lit : all) {
    const Eigen::Vector3d figures(lit.hue, lit.range, lit.brightness);
    sums += figures * figures.transpose();
  }
  return sums.bottomRightCorner<2, 2>() -
         sums.col(0).tail<2>() * sums.row(0).tail<2>() / std::max(1e-300, sums(0, 0));
}

}  // namespace

double correlation_in(const Eigen::Matrix2d& spread) {
  const double both = spread(0, 0) * spread(1, 1);
  return both > 0 ? spread(0, 1) / std::sqrt(both) : 0;
}

LampAgreement lamp_agreement(const Scene& scene) {
  constexpr std::size_t kFewest = 50;
  std::vector<Lit> all = lit_sightings(scene);
  if (all.size() < kFewest) return {};
  // The exposure is each frame's own: only what differs within one tells.
  take_from_means(&Lit::view, scene.camera_from_world.size(), all);
  const Eigen::Matrix2d spread = spread_of(all);
  LampAgreement lamp{correlation_in(spread), spread(0, 1) / std::max(1e-300, spread(0, 0)), 0,
                     all.size()};
  // Both means in turn until neither place nor frame is brighter than others by itself.
  constexpr int kSweeps = 8;
  for (int i = 0; i < kSweeps; ++i) {
    take_from_means(&Lit::landmark, scene.landmarks.size(), all);
    take_from_means(&Lit::view, scene.camera_from_world.size(), all);
  }
  lamp.correlation_over_time = correlation_in(spread_of(all));
  return lamp;
}

namespace {

constexpr double kLampSpeaks = 0.5;  // correlation, but for its sign
// Correlation over time from which the light comes with the lens: under a still lamp each place
// stays as bright as it is.
constexpr double kMovesWithTheLens = 0.2;
constexpr double kSteepestLamp = -8;  // of ln brightness by ln range; −2 is the inverse square
constexpr double kNearlyAsGood = 1.1, kLensUnsure = 0.1, kLensUntold = 0.4, kUnlikeAScope = 3,
                 kFewPosed = 0.5;

}  // namespace

MotionQuality judge_motion(const ClipMotion& motion, const LampAgreement& lamp, double runner_up,
                           bool lens_is_free) {
  MotionQuality quality{DepthVerdict::ok, "", runner_up, lamp.correlation, lamp.slope, 0};
  const auto posed = std::count_if(motion.camera_from_world.begin(), motion.camera_from_world.end(),
                                   [](const auto& pose) { return pose.has_value(); });
  quality.posed_share =
      double(posed) / double(std::max<std::size_t>(1, motion.camera_from_world.size()));
  const Intrinsics& lens = motion.scene.lens;
  const double focal_sd = lens_is_free ? motion.lens_spread.focal_px / lens.fx : 0;
  const bool lamp_objects = lamp.correlation > LampAgreement::kObjects;
  const bool has_rival = runner_up > 0 && runner_up < kNearlyAsGood;
  const bool no_scope = lens_is_free && unlike_a_scope(lens).norm() > kUnlikeAScope;
  const bool too_flat = lamp.correlation < -kLampSpeaks && lamp.slope < kSteepestLamp;
  const std::pair<bool, std::string> failures[] = {
      {no_scope && too_flat,
       "parallax and lamp contradict each other: the scene is far flatter than its brightness "
       "says, and the lens that was found is none of a scope"},
      {lamp_objects && (lens_is_free || std::abs(lamp.correlation_over_time) > kMovesWithTheLens),
       "parallax and lamp contradict each other: what the scene has nearer to the lamp is darker "
       "(correlation of brightness and distance " +
           to_text(lamp.correlation, 2) + "), as if it were inside out"},
      {has_rival && lamp.sightings > 0 && lamp.correlation > -LampAgreement::kObjects,
       "the same scene turned inside out fits as well, and the lamp does not tell which is right"},
      {focal_sd > kLensUntold, "the clip does not tell its lens: the focal length is known to " +
                                   percent(focal_sd) + " only"}};
  for (const auto& [holds, reason] : failures) {
    if (!holds) continue;
    quality.verdict = DepthVerdict::failed;
    quality.reason = lens_is_free ? reason + "; give the lens (--intrinsics)" : reason;
    return quality;
  }
  const std::pair<bool, std::string> doubts[] = {
      {lamp_objects,
       "what the scene has nearer to the lens is darker: it is inside out, or the light is not at "
       "the lens"},
      {has_rival,
       "another scene, as this one turned inside out, fits nearly as well (its cost is " +
           to_text(runner_up, 2) + " times the chosen one's)"},
      {no_scope,
       "the lens that was found is none of a scope: it sees " +
           to_text(2 * std::atan(0.5 * lens.width / lens.fx) * 180 / std::numbers::pi, 0) +
           " degrees"},
      {focal_sd > kLensUnsure,
       "the focal length is known to " + percent(focal_sd) + " only, and depth is as uncertain"},
      {too_flat, "the scene is far flatter than its brightness says"},
      {motion.breath_period_frames > 0 && motion.scene.breath.empty(),
       "tissue moves and comes back every " + to_text(motion.breath_period_frames, 0) +
           " frames, as by breathing, and its motion cannot be told from the scope's: the path may "
           "be several per cent wrong"},
      {quality.posed_share < kFewPosed,
       "only " + percent(quality.posed_share) + " of the frames have a pose"}};
  for (const auto& [holds, reason] : doubts) {
    if (!holds) continue;
    quality.verdict = DepthVerdict::doubtful;
    quality.reason += (quality.reason.empty() ? "" : "; ") + reason;
  }
  return quality;
}

}  // namespace organbake
