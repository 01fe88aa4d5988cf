// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which scene a clip shows, where several explain it nearly as well. A scene turned inside out
// looks alike through a long lens (Koenderink & van Doorn 1991), and so does a flatter one through
// a longer lens. In: sightings with their light, a lens or what is known of scopes'. A sample of
// the views is solved from several focal lengths and, for each scene that is found, from its mirror
// image; the light tells by the lamp at the lens which one is right side out. Out: the poses to
// begin with, and what the next best scene costs.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
namespace {

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
        part.seen.push_back({i, seen->pixel, true, seen->light});
    if (part.seen.size() >= 2) sample.landmarks.push_back(std::move(part));
  }
  std::stable_sort(
      sample.landmarks.begin(), sample.landmarks.end(),
      [](const Landmark& a, const Landmark& b) { return a.seen.size() > b.seen.size(); });
  if (sample.landmarks.size() > kMostLandmarks) sample.landmarks.resize(kMostLandmarks);
  return sample;
}

// Of a scene that has some.
std::size_t middle_posed(const Scene& scene) {
  const std::vector<std::size_t> posed = scene.posed();
  return posed[posed.size() / 2];
}

// The scene mirrored at a plane across the middle view: from far away, or through a long lens, it
// looks the same, and its cameras turn the other way round.
Scene turned_inside_out(Scene scene) {
  const RigidTransform to_middle = *scene.camera_from_world[middle_posed(scene)],
                       back = to_middle.inverse();
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
  double cost = 0;
  LampAgreement lamp;
};

// Correlation of the depths that both scenes give the places before one view.
double alike_in_depth(const Scene& a, const Scene& b) {
  const std::size_t view = middle_posed(a);
  if (!b.is_posed(view)) return 0;
  std::vector<Eigen::Vector2d> depths;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < a.landmarks.size(); ++i)
    if (a.landmarks[i].place && b.landmarks[i].place) {
      depths.emplace_back((*a.camera_from_world[view] * *a.landmarks[i].place).z(),
                          (*b.camera_from_world[view] * *b.landmarks[i].place).z());
      mean += depths.back();
    }
  mean /= std::max<double>(1, static_cast<double>(depths.size()));
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& depth : depths) spread += (depth - mean) * (depth - mean).transpose();
  return correlation_in(spread);
}

bool is_same(const Basin& a, const Basin& b) {
  constexpr double kSameDepth = 0.8;
  return alike_in_depth(a.scene, b.scene) > kSameDepth;
}

std::vector<Basin> settled(const FreeLens& lens, std::vector<Scene> scenes, bool begun,
                           const RunContext& context) {
  constexpr int kIterations = 30;
  std::vector<Basin> found(scenes.size());
  parallel_for(std::size_t{0}, scenes.size(), [&](std::size_t i) {
    found[i].scene = std::move(scenes[i]);
    // With a lens that gives way a mirror image would turn back before it has settled.
    if (begun)
      settle({.iterations = kIterations}, found[i].scene);
    else if (!reconstruct(lens, found[i].scene, context).empty())
      return;
    settle({.lens = lens, .iterations = kIterations}, found[i].scene);
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

// What speaks against a scene: its error, a lens that no scope has, and the lamp, in so far as
// scenes fit about as well.
double price(const Basin& basin, const FreeLens& free) {
  constexpr double kOfLens = 0.05, kOfLamp = 2;
  const double unlike = free.focal ? unlike_a_scope(basin.scene.lens).squaredNorm() : 0;
  return basin.cost * (1 + kOfLens * unlike) *
         (1 + kOfLamp * std::max(0.0, basin.lamp.correlation - LampAgreement::kObjects));
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

BasinChoice choose_basin(const FreeLens& whole, Scene& scene, const RunContext& context) {
  // A few views tell distortion from focal length badly.
  const FreeLens free{.focal = whole.focal};
  const std::vector<std::size_t> views = sampled_views(scene);
  const Scene sample = sample_of(scene, views);
  std::vector<Scene> starts;
  for (const Intrinsics& lens : starts_of(free, scene.lens)) {
    starts.push_back(sample);
    starts.back().lens = lens;
  }
  // Each start ends in the basin that its focal length lies in.
  std::vector<Basin> basins = settled(free, std::move(starts), false, context);
  BasinChoice choice;
  if (basins.empty()) return choice;
  weigh(basins);
  // No start leads to the other side of a mirror: it is stepped through.
  for (Basin& basin : settled(free, turned_inside_out(basins), true, context))
    basins.push_back(std::move(basin));
  weigh(basins);
  for (Basin& basin : basins) basin.lamp = lamp_agreement(basin.scene);
  std::stable_sort(basins.begin(), basins.end(),
                   [&](const Basin& a, const Basin& b) { return price(a, free) < price(b, free); });
  // The sample's poses are what the whole scene grows from.
  const Basin& best = basins.front();
  scene.lens = best.scene.lens;
  for (std::size_t i = 0; i < views.size(); ++i)
    scene.camera_from_world[views[i]] = best.scene.camera_from_world[i];
  for (const Basin& basin : basins) {
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

}  // namespace organbake
