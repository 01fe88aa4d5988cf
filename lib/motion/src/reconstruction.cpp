// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/reconstruction.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "resection.h"
#include "two_views.h"

namespace organbake {
namespace {

struct Pair {
  std::size_t first = 0, second = 0;
  TwoViews relation;
  // Many pairs under an angle at which depth is sure; wider ones see each other less well.
  double score() const {
    constexpr double kWideEnough_rad = 0.1;
    return static_cast<double>(relation.agreeing) *
           std::min(relation.median_angle_rad, kWideEnough_rad);
  }
};

TwoViews relate(const Scene& scene, std::size_t a, std::size_t b) {
  std::vector<Eigen::Vector2d> first, second;
  for (const std::size_t i : seen_by_both(scene.landmarks, a, b)) {
    first.push_back(sighting_in(scene.landmarks[i], a)->pixel);
    second.push_back(sighting_in(scene.landmarks[i], b)->pixel);
  }
  return relate_views(scene.lens, first, second);
}

// Pairs from near to far apart, spread over the clip.
std::vector<Pair> candidate_pairs(const Scene& scene, const std::vector<std::size_t>& keys) {
  constexpr std::size_t kStarts = 8;
  const std::size_t step = std::max<std::size_t>(1, keys.size() / kStarts);
  std::vector<Pair> pairs;
  for (std::size_t first = 0; first < keys.size(); first += step)
    for (const std::size_t apart : {1, 2, 4})
      if (first + apart < keys.size()) pairs.push_back({keys[first], keys[first + apart], {}});
  parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t i) {
    pairs[i].relation = relate(scene, pairs[i].first, pairs[i].second);
  });
  return pairs;
}

// The views that the scene grows by: so many hold it, and each more costs another adjustment.
std::vector<std::size_t> keys_among(std::size_t views) {
  constexpr std::size_t kMost = 24;
  const std::size_t step = (views + kMost - 1) / kMost;
  std::vector<std::size_t> keys;
  for (std::size_t view = 0; view < views; view += std::max<std::size_t>(1, step))
    keys.push_back(view);
  return keys;
}

class Growth {
 public:
  Growth(const ReconstructionOptions& options, Scene& scene, const RunContext& context)
      : options_(options),
        scene_(scene),
        context_(context),
        keys_(keys_among(scene.camera_from_world.size())) {}

  ReconstructionSummary run() {
    ReconstructionSummary summary;
    const std::vector<Pair> pairs = candidate_pairs(scene_, keys_);
    for (const Pair& pair : pairs)
      summary.parallax_px = std::max(summary.parallax_px, pair.relation.parallax_px);
    const auto best =
        std::max_element(pairs.begin(), pairs.end(),
                         [&](const Pair& a, const Pair& b) { return worth(a) < worth(b); });
    if (best == pairs.end() || worth(*best) <= 0) {
      summary.failure = "no two frames see the tissue from places far enough apart (parallax of " +
                        to_text(summary.parallax_px, 1) + " pixels)";
      return summary;
    }
    begin(*best);
    grow();
    add_others();
    return summary;
  }

 private:
  double worth(const Pair& pair) const {
    return pair.relation.parallax_px >= options_.least_parallax_px &&
                   pair.relation.median_angle_rad >= options_.least_pair_angle_rad
               ? pair.score()
               : 0;
  }

  void begin(const Pair& pair) {
    scene_.camera_from_world[pair.first] = RigidTransform{};
    scene_.camera_from_world[pair.second] = pair.relation.second_from_first;
    triangulate(options_.triangulation, scene_);
    settle({}, 10);
  }

  // The unposed key that sees most places.
  std::optional<std::size_t> next_view(const std::vector<bool>& refused) const {
    std::vector<std::size_t> places(scene_.camera_from_world.size(), 0);
    for (const Landmark& landmark : scene_.landmarks)
      if (landmark.place)
        for (const Sighting& sighting : landmark.seen) ++places[sighting.view];
    std::optional<std::size_t> best;
    for (const std::size_t view : keys_) {
      if (scene_.is_posed(view) || refused[view]) continue;
      if (!best || places[view] > places[*best]) best = view;
    }
    return best;
  }

  void grow() {
    std::vector<bool> refused(scene_.camera_from_world.size(), false);
    std::size_t settled_at = scene_.posed_views();
    while (const auto view = next_view(refused)) {
      context_.throw_if_cancelled();
      refused[*view] = !pose_view(options_.least_agreeing_share, *view, scene_);
      if (refused[*view]) continue;
      triangulate(options_.triangulation, scene_, view);
      settle_near(*view);
      const std::size_t posed = scene_.posed_views();
      context_.progress(static_cast<double>(posed) / static_cast<double>(keys_.size()));
      if (posed * 4 < settled_at * 5 && posed < settled_at + 8) continue;
      settle(lens_now(posed), 10);
      settled_at = posed;
      std::fill(refused.begin(), refused.end(), false);
    }
  }

  // A lens is told by several views only, and what it does at the borders by more.
  FreeLens lens_now(std::size_t posed) const {
    FreeLens free = options_.lens;
    free.focal = free.focal && posed >= 4;
    free.distortion = free.distortion && posed >= 6;
    free.center = false;
    return free;
  }

  void settle(const FreeLens& lens, int iterations) {
    adjust({.lens = lens, .iterations = iterations, .tolerance = 1e-3, .sightings_per_view = 250},
           scene_);
    drop_outliers(options_.triangulation, scene_);
    triangulate(options_.triangulation, scene_);
  }

  // The new view and those around it, the others held.
  void settle_near(std::size_t view) {
    const std::size_t near = 3 * (keys_.size() > 1 ? keys_[1] - keys_[0] : 1);
    std::vector<bool> moving(scene_.camera_from_world.size(), false);
    for (std::size_t other = 0; other < moving.size(); ++other)
      moving[other] = scene_.is_posed(other) && other + near >= view && other <= view + near;
    // Somebody has to hold the scene where it is.
    if (std::count(moving.begin(), moving.end(), true) ==
        static_cast<std::ptrdiff_t>(scene_.posed_views()))
      moving.clear();
    adjust({.iterations = 4, .tolerance = 1e-3, .sightings_per_view = 120, .moving = moving},
           scene_);
  }

  // The views between the keys, each from the places that it sees; as long as some more become
  // known by others.
  void add_others() {
    settle(lens_now(scene_.posed_views()), 15);
    for (std::size_t posed = 0; posed < scene_.posed_views();) {
      context_.throw_if_cancelled();
      posed = scene_.posed_views();
      parallel_for(std::size_t{0}, scene_.camera_from_world.size(), [&](std::size_t view) {
        if (!scene_.is_posed(view)) pose_view(options_.least_agreeing_share, view, scene_);
      });
      triangulate(options_.triangulation, scene_);
    }
    settle(options_.lens, 20);
  }

  const ReconstructionOptions& options_;
  Scene& scene_;
  const RunContext& context_;
  const std::vector<std::size_t> keys_;
};

}  // namespace

ReconstructionSummary reconstruct(const ReconstructionOptions& options, Scene& scene,
                                  const RunContext& context) {
  return Growth(options, scene, context).run();
}

}  // namespace organbake
