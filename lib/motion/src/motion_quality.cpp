// SPDX-License-Identifier: GPL-3.0-or-later
//
// How sure a clip's scene is. In: a scene, the pictures of its views, what another scene costs.
// Out: how its distances agree with the light of a lamp at the lens; the lens's standard deviations
// (block jackknife, Künsch 1989); the verdict.
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

// One sighting: logarithms of the green light round it, of green by red light, and of the range
// from the lamp.
struct Lit {
  std::size_t landmark, view;
  double brightness, hue, range;
};

// Linear light, red and green; nothing where it is overexposed or black.
std::optional<Eigen::Vector2d> light_at(const Rgb8Image& picture, const Eigen::Vector2d& pixel) {
  constexpr int kOfWidth = 160, kBurnt = 250;
  const int reach = std::max(1, picture.width / kOfWidth), step = std::max(1, reach / 3);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (int dy = -reach; dy <= reach; dy += step)
    for (int dx = -reach; dx <= reach; dx += step) {
      const int x = static_cast<int>(pixel.x()) + dx, y = static_cast<int>(pixel.y()) + dy;
      if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) continue;
      const std::uint8_t* color = picture.at(x, y);
      if (*std::max_element(color, color + 3) > kBurnt) return std::nullopt;
      sum += Eigen::Vector2d(linear_from_srgb8()[color[0]], linear_from_srgb8()[color[1]]);
      ++count;
    }
  return sum.minCoeff() > 0 ? std::optional(Eigen::Vector2d(sum / count)) : std::nullopt;
}

std::vector<Lit> lit_sightings(const std::vector<const ClipPicture*>& views, const Scene& scene) {
  std::vector<Lit> all;
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    const Landmark& landmark = scene.landmarks[i];
    if (!landmark.place) continue;
    for (const Sighting& seen : landmark.seen) {
      if (!seen.agrees || !scene.is_posed(seen.view) || !views[seen.view]) continue;
      const double range = (*scene.camera_from_world[seen.view] * *landmark.place).norm();
      if (const auto light = light_at(views[seen.view]->picture.color, seen.pixel))
        all.push_back({i, seen.view, std::log(light->y()), std::log(light->y() / light->x()),
                       std::log(range)});
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

LampAgreement lamp_agreement(const std::vector<const ClipPicture*>& views, const Scene& scene) {
  constexpr std::size_t kFewest = 50;
  std::vector<Lit> all = lit_sightings(views, scene);
  if (all.size() < kFewest) return {};
  // The exposure is each frame's own: only what differs within one tells.
  take_from_means(&Lit::view, views.size(), all);
  const Eigen::Matrix2d spread = spread_of(all);
  LampAgreement lamp{correlation_in(spread), spread(0, 1) / std::max(1e-300, spread(0, 0)), 0,
                     all.size()};
  constexpr int kSweeps = 8;
  for (int i = 0; i < kSweeps; ++i) {
    take_from_means(&Lit::landmark, scene.landmarks.size(), all);
    take_from_means(&Lit::view, views.size(), all);
  }
  lamp.correlation_over_time = correlation_in(spread_of(all));
  return lamp;
}

namespace {

constexpr std::size_t kParts = 4;

// The lens as all but one part of the posed views have it.
Intrinsics lens_without_views(std::size_t part, const FreeLens& free, Scene scene) {
  const std::size_t posed = scene.posed_views();
  std::size_t at = 0;
  for (auto& pose : scene.camera_from_world) {
    if (!pose) continue;
    if (at++ * kParts / posed == part) pose.reset();
  }
  adjust({.lens = free, .iterations = 12, .sightings_per_view = 150}, scene);
  return scene.lens;
}

// The lens as all but the features of one side of the picture have it.
Intrinsics lens_without_side(std::size_t part, const FreeLens& free, Scene scene) {
  const Eigen::Vector2d middle(scene.lens.cx, scene.lens.cy);
  for (Landmark& landmark : scene.landmarks) {
    const Eigen::Vector2d from_middle = landmark.seen[landmark.seen.size() / 2].pixel - middle;
    const std::size_t side = (from_middle.x() > 0 ? 1 : 0) + (from_middle.y() > 0 ? 2 : 0);
    if (side == part) landmark.place.reset();
  }
  adjust({.lens = free, .iterations = 12, .sightings_per_view = 150}, scene);
  return scene.lens;
}

double jackknife_sd(const std::vector<Intrinsics>& lenses, double Intrinsics::*figure) {
  double mean = 0, squares = 0;
  for (const Intrinsics& lens : lenses) mean += lens.*figure / kParts;
  for (const Intrinsics& lens : lenses) squares += std::pow(lens.*figure - mean, 2);
  return std::sqrt(squares * (kParts - 1) / kParts);
}

}  // namespace

LensSpread lens_spread(const FreeLens& free, const Scene& scene, double focal_variance_px2) {
  if (!free.any()) return {};
  const bool in_time = scene.posed_views() >= 2 * kParts;
  std::vector<Intrinsics> parts(kParts), sides(kParts);
  parallel_for(std::size_t{0}, 2 * kParts, [&](std::size_t i) {
    if (i < kParts)
      sides[i] = lens_without_side(i, free, scene);
    else if (in_time)
      parts[i - kParts] = lens_without_views(i - kParts, free, scene);
  });
  const auto spread = [&](double Intrinsics::*figure) {
    // Measured on seeded clips: parts have tracks in common, and a lens that fewer views hold
    // strays farther than the whole clip's errs.
    constexpr double kOfError = 0.65;
    const double by_sides = jackknife_sd(sides, figure);
    return kOfError * (in_time ? std::hypot(by_sides, jackknife_sd(parts, figure)) / std::sqrt(2.0)
                               : by_sides);
  };
  // Whatever is left out, windows slide along edges a little in the same way.
  constexpr double kNeverTold = 0.005;
  const double of_focal = std::hypot(spread(&Intrinsics::fx), kNeverTold * scene.lens.fx);
  return {free.focal ? std::hypot(of_focal, std::sqrt(focal_variance_px2)) : 0,
          spread(&Intrinsics::k1), spread(&Intrinsics::cx), spread(&Intrinsics::cy)};
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
