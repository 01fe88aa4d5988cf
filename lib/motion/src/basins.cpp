// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which scene a clip shows, where several explain it nearly as well, and how sure that is. A scene
// turned inside out looks alike through a long lens (Koenderink & van Doorn 1991), and so does a
// flatter one through a longer lens. In: sightings, a lens or what is known of scopes' lenses,
// pictures. A sample of the views is solved from several focal lengths and, for each scene that is
// found, from its mirror image; the pictures tell by the lamp at the lens which one is right side
// out. Out: the poses to begin with, what the next best scene costs, the lens's standard deviations
// (block jackknife, Künsch 1989), the verdict.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/image/srgb.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
namespace {

double focal_of_view(const Intrinsics& lens, double view_rad) {
  return 0.5 * lens.width / std::tan(0.5 * view_rad);
}

// Scopes see 50 to 120 degrees across the picture: taken as two standard deviations to either side
// of a focal length's logarithm.
constexpr double kNarrowScope_rad = 0.8727, kWideScope_rad = 2.0944;

// Their barrel distortion draws the picture's corners in by a tenth, give or take.
constexpr double kUsualBarrel = -0.1, kUsualBarrelSd = 0.15;

// Of a lens's focal length and distortion, by how many standard deviations it is unlike a scope's.
Eigen::Vector2d unlike_a_scope(const Intrinsics& lens) {
  const double longest = std::log(focal_of_view(lens, kNarrowScope_rad)),
               shortest = std::log(focal_of_view(lens, kWideScope_rad));
  const double corner = std::hypot(lens.width, lens.height) / (2 * lens.fx);
  return {(std::log(lens.fx) - 0.5 * (longest + shortest)) / (0.25 * (longest - shortest)),
          (lens.k1 * corner * corner - kUsualBarrel) / kUsualBarrelSd};
}

// Starts that are a factor of about 1.5 apart, and the caller's own.
std::vector<Intrinsics> starts_of(const FreeLens& free, const Intrinsics& lens) {
  std::vector<Intrinsics> starts = {lens};
  if (!free.focal) return starts;
  constexpr double kViews_rad[] = {0.8727, 1.2217, 1.6057, 2.0071};
  constexpr double kAlike = 0.15;
  for (const double view_rad : kViews_rad) {
    Intrinsics start = lens;
    start.fx = focal_of_view(lens, view_rad);
    start.fy *= start.fx / lens.fx;
    if (std::abs(std::log(start.fx / lens.fx)) > kAlike) starts.push_back(start);
  }
  return starts;
}

// Views that hold together, at most kMost of them, out of the middle of the clip, as far apart as
// they share enough features.
std::vector<std::size_t> sampled_views(const Scene& scene) {
  constexpr std::size_t kMost = 10, kEnoughShared = 150;
  const std::size_t views = scene.camera_from_world.size();
  std::size_t step = (views + kMost - 1) / kMost;
  const auto shared = [&] {
    std::vector<std::size_t> counts;
    for (std::size_t view = 0; view + step < views; view += step)
      counts.push_back(seen_by_both(scene.landmarks, view, view + step).size());
    return median(std::move(counts));
  };
  while (step > 1 && shared() < kEnoughShared) step = (step + 1) / 2;
  const std::size_t count = std::min(kMost, (views - 1) / step + 1);
  const std::size_t first = (views - 1 - (count - 1) * step) / 2;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(first + i * step);
  return chosen;
}

// These views alone, counted anew, and the longest of their tracks.
Scene sample_of(const Scene& scene, const std::vector<std::size_t>& views) {
  constexpr std::size_t kMostLandmarks = 400;
  Scene sample;
  sample.lens = scene.lens;
  sample.camera_from_world.resize(views.size());
  for (const Landmark& landmark : scene.landmarks) {
    Landmark part{landmark.track, {}, {}};
    for (std::size_t i = 0; i < views.size(); ++i)
      if (const Sighting* seen = sighting_in(landmark, views[i]))
        part.seen.push_back({i, seen->pixel});
    if (part.seen.size() >= 2) sample.landmarks.push_back(std::move(part));
  }
  std::stable_sort(
      sample.landmarks.begin(), sample.landmarks.end(),
      [](const Landmark& a, const Landmark& b) { return a.seen.size() > b.seen.size(); });
  if (sample.landmarks.size() > kMostLandmarks) sample.landmarks.resize(kMostLandmarks);
  return sample;
}

std::optional<std::size_t> middle_posed(const Scene& scene) {
  std::vector<std::size_t> posed;
  for (std::size_t view = 0; view < scene.camera_from_world.size(); ++view)
    if (scene.is_posed(view)) posed.push_back(view);
  return posed.empty() ? std::nullopt : std::optional(posed[posed.size() / 2]);
}

// The scene mirrored at a plane across the middle view: from far away, or through a long lens, it
// looks the same, and its cameras turn the other way round.
Scene turned_inside_out(Scene scene) {
  const std::optional<std::size_t> middle = middle_posed(scene);
  if (!middle) return scene;
  const RigidTransform to_middle = *scene.camera_from_world[*middle], back = to_middle.inverse();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double places = 0;
  for (Landmark& landmark : scene.landmarks) {
    if (!landmark.place) continue;
    landmark.place = to_middle * *landmark.place;
    center += *landmark.place;
    ++places;
  }
  center /= std::max(1.0, places);
  const Eigen::DiagonalMatrix<double, 3> mirror(1, 1, -1);
  for (Landmark& landmark : scene.landmarks)
    if (landmark.place) landmark.place = center + mirror * (*landmark.place - center);
  for (auto& pose : scene.camera_from_world) {
    if (!pose) continue;
    const RigidTransform before = *pose * back;
    pose->rotation = mirror * before.rotation * mirror;
    pose->translation = before * center - pose->rotation * center;
  }
  return scene;
}

// A scene that a search ended in.
struct Basin {
  Scene scene;
  double parallax_px = 0, cost = 0;
  LampAgreement lamp;
};

void settle(const ReconstructionOptions& options, const FreeLens& lens, Scene& scene) {
  constexpr int kIterations = 30;
  adjust({.lens = lens, .iterations = kIterations}, scene);
  drop_outliers(options.triangulation, scene);
  triangulate(options.triangulation, scene);
}

// Correlation of the depths that both scenes give the places before one view.
double alike_in_depth(const Scene& a, const Scene& b) {
  const std::optional<std::size_t> view = middle_posed(a);
  if (!view || !b.is_posed(*view)) return 0;
  std::vector<Eigen::Vector2d> depths;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < a.landmarks.size(); ++i)
    if (a.landmarks[i].place && b.landmarks[i].place) {
      depths.emplace_back((*a.camera_from_world[*view] * *a.landmarks[i].place).z(),
                          (*b.camera_from_world[*view] * *b.landmarks[i].place).z());
      mean += depths.back();
    }
  mean /= std::max<double>(1, static_cast<double>(depths.size()));
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& depth : depths) spread += (depth - mean) * (depth - mean).transpose();
  return spread(0, 1) / std::sqrt(std::max(1e-300, spread(0, 0) * spread(1, 1)));
}

bool is_same(const Basin& a, const Basin& b) {
  constexpr double kSameDepth = 0.8;
  return alike_in_depth(a.scene, b.scene) > kSameDepth;
}

std::vector<Basin> settled(const ReconstructionOptions& options, std::vector<Scene> scenes,
                           bool begun, const RunContext& context) {
  std::vector<Basin> found(scenes.size());
  parallel_for(std::size_t{0}, scenes.size(), [&](std::size_t i) {
    found[i].scene = std::move(scenes[i]);
    if (!begun) {
      const ReconstructionSummary summary = reconstruct(options, found[i].scene, context);
      found[i].parallax_px = summary.parallax_px;
      if (!summary.failure.empty()) return;
    }
    // With a lens that gives way a mirror image would turn back before it has settled.
    if (begun) settle(options, {}, found[i].scene);
    settle(options, options.lens, found[i].scene);
  });
  std::erase_if(found, [](const Basin& basin) { return basin.scene.posed_views() < 3; });
  return found;
}

// Mean robust error of the sightings that any of the scenes explains.
void weigh(std::vector<Basin>& basins) {
  constexpr double kExplained_px = 3, kMost_px = 6;
  for (Basin& basin : basins) basin.cost = 0;
  double sightings = 0;
  for (std::size_t i = 0; i < basins[0].scene.landmarks.size(); ++i)
    for (std::size_t k = 0; k < basins[0].scene.landmarks[i].seen.size(); ++k) {
      std::vector<double> errors;
      for (const Basin& basin : basins) {
        const Landmark& landmark = basin.scene.landmarks[i];
        const bool known = landmark.place && basin.scene.is_posed(landmark.seen[k].view);
        errors.push_back(known
                             ? std::min(kMost_px, basin.scene.error_px(landmark, landmark.seen[k]))
                             : kMost_px);
      }
      if (*std::min_element(errors.begin(), errors.end()) > kExplained_px) continue;
      ++sightings;
      for (std::size_t b = 0; b < basins.size(); ++b)
        basins[b].cost += std::log1p(errors[b] * errors[b]);
    }
  for (Basin& basin : basins) basin.cost /= std::max(1.0, sightings);
}

constexpr double kLampObjects = 0.3;  // correlation from which it does

// What speaks against a scene: its error, a lens that no scope has, and the lamp, in so far as
// scenes fit about as well.
double price(const Basin& basin, const FreeLens& free) {
  constexpr double kOfLens = 0.05, kOfLamp = 1;
  const double unlike = free.focal ? unlike_a_scope(basin.scene.lens).squaredNorm() : 0;
  return basin.cost * (1 + kOfLens * unlike) *
         (1 + kOfLamp * std::max(0.0, basin.lamp.correlation - kLampObjects));
}

// The mirror images of those that fit at all well, each scene's once.
std::vector<Scene> turned_inside_out(const std::vector<Basin>& basins) {
  constexpr double kWell = 2.5;  // times the least cost
  double least = basins[0].cost;
  for (const Basin& basin : basins) least = std::min(least, basin.cost);
  std::vector<Scene> turned;
  for (auto basin = basins.begin(); basin != basins.end(); ++basin)
    if (basin->cost <= kWell * least &&
        std::none_of(basins.begin(), basin,
                     [&](const Basin& before) { return is_same(before, *basin); }))
      turned.push_back(turned_inside_out(basin->scene));
  return turned;
}

}  // namespace

BasinChoice choose_basin(const ReconstructionOptions& whole, const PictureLoader& load,
                         const std::vector<std::size_t>& frames, Scene& scene,
                         const RunContext& context) {
  // A few views tell distortion from focal length badly.
  ReconstructionOptions options = whole;
  options.lens.distortion = false;
  const std::vector<std::size_t> views = sampled_views(scene);
  const Scene sample = sample_of(scene, views);
  std::vector<Scene> starts;
  for (const Intrinsics& lens : starts_of(options.lens, scene.lens)) {
    starts.push_back(sample);
    starts.back().lens = lens;
  }
  std::vector<Basin> basins = settled(options, std::move(starts), false, context);
  BasinChoice choice;
  if (basins.empty()) return choice;
  weigh(basins);
  for (Basin& basin : settled(options, turned_inside_out(basins), true, context))
    basins.push_back(std::move(basin));
  weigh(basins);
  std::vector<std::size_t> sampled_frames;
  for (const std::size_t view : views) sampled_frames.push_back(frames[view]);
  const auto pictures = load(sampled_frames);
  for (Basin& basin : basins) basin.lamp = lamp_agreement(pictures, basin.scene);
  const FreeLens& free = options.lens;
  std::stable_sort(basins.begin(), basins.end(),
                   [&](const Basin& a, const Basin& b) { return price(a, free) < price(b, free); });
  const Basin& best = basins.front();
  scene.lens = best.scene.lens;
  for (std::size_t i = 0; i < views.size(); ++i)
    scene.camera_from_world[views[i]] = best.scene.camera_from_world[i];
  for (const Basin& basin : basins) {
    choice.parallax_px = std::max(choice.parallax_px, basin.parallax_px);
    // Of one shape through several lenses all views together tell the right one.
    if (is_same(best, basin)) continue;
    const double costs = price(basin, free) / std::max(1e-9, price(best, free));
    if (choice.runner_up == 0 || costs < choice.runner_up) choice.runner_up = costs;
    // What fits a twentieth worse is believed a third as much.
    constexpr double kBelieved = 0.05;
    choice.focal_variance_px2 +=
        std::exp((1 - costs) / kBelieved) * std::pow(basin.scene.lens.fx - best.scene.lens.fx, 2);
  }
  return choice;
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

double correlation_in(const Eigen::Matrix2d& spread) {
  const double both = spread(0, 0) * spread(1, 1);
  return both > 0 ? spread(0, 1) / std::sqrt(both) : 0;
}

}  // namespace

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
constexpr double kNearlyAsGood = 1.1, kLensUnsure = 0.1, kUnlikeAScope = 3, kFewPosed = 0.5;

}  // namespace

MotionQuality judge_motion(const ClipMotion& motion, const LampAgreement& lamp, double runner_up,
                           bool lens_is_free) {
  MotionQuality quality{DepthVerdict::ok, "", runner_up, lamp.correlation, lamp.slope, 0};
  const auto posed = std::count_if(motion.camera_from_world.begin(), motion.camera_from_world.end(),
                                   [](const auto& pose) { return pose.has_value(); });
  quality.posed_share =
      double(posed) / double(std::max<std::size_t>(1, motion.camera_from_world.size()));
  const bool lamp_objects = lamp.correlation > kLampObjects;
  if (lamp_objects && std::abs(lamp.correlation_over_time) > kMovesWithTheLens) {
    quality.verdict = DepthVerdict::failed;
    quality.reason =
        "parallax and lamp contradict each other: what the scene has nearer to the lamp is darker "
        "(correlation of brightness and distance " +
        to_text(lamp.correlation, 2) + "), as if it were inside out";
    return quality;
  }
  const Intrinsics& lens = motion.scene.lens;
  const double focal_sd = motion.lens_spread.focal_px / lens.fx;
  const std::pair<bool, std::string> doubts[] = {
      {lamp_objects,
       "what the scene has nearer to the lens is darker: it is inside out, or the light is not at "
       "the lens"},
      {runner_up > 0 && runner_up < kNearlyAsGood,
       "another scene, as this one turned inside out, fits nearly as well (its cost is " +
           to_text(runner_up, 2) + " times the chosen one's)"},
      {lens_is_free && unlike_a_scope(lens).norm() > kUnlikeAScope,
       "the lens that was found is none of a scope: it sees " +
           to_text(2 * std::atan(0.5 * lens.width / lens.fx) * 57.29577951308232, 0) + " degrees"},
      {lens_is_free && focal_sd > kLensUnsure,
       "the focal length is known to " + percent(focal_sd) + " only, and depth is as uncertain"},
      {lamp.sightings > 0 && lamp.correlation < -kLampSpeaks && lamp.slope < kSteepestLamp,
       "the scene is far flatter than its brightness says"},
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
