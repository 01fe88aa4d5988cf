// SPDX-License-Identifier: GPL-3.0-or-later
// How much of the relief that shading finds is safe to keep (shading/relief_share.h): held against
// scenes of known depth, and, by `organbench relief --only refit`, fitted to others.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "bench.h"
#include "measuring/relief_scenes.h"
#include "organbake/core/text.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/relief_share.h"

namespace organbake {
namespace {

// Scenes that are tested, and those that the model is fitted to: no seed is in both.
constexpr std::uint64_t kFirstTested = 1, kFirstFitted = 1000;
constexpr int kFittedScenes = 120;

constexpr std::size_t kShares = 6;  // 0, 0.2 … 1, of the tilt and of the rest

// A scene, as the fit and the figures need it.
struct Judged {
  ReliefEvidence evidence;
  ReliefShare kept;  // by the frame's own depth
  // Mean relative error of depth, by the shares kept of the tilt and of the rest; the plane first.
  std::array<std::array<double, kShares>, kShares> errors = {};

  // Of shares, by a plane's.
  double ratio(const ReliefShare& share) const {
    const auto [tilt, tilt_part] = place_of(share.tilt);
    const auto [rest, rest_part] = place_of(share.rest);
    const auto at = [&](std::size_t row) {
      return std::lerp(errors[row][rest], errors[row][rest + 1], rest_part);
    };
    return std::lerp(at(tilt), at(tilt + 1), tilt_part) / errors[0][0];
  }
  // The least that any shares reach, and what all of the relief does.
  double least_ratio() const {
    double least = 1;
    for (const auto& row : errors)
      least = std::min(least, *std::min_element(row.begin(), row.end()) / errors[0][0]);
    return least;
  }
  double full_ratio() const { return errors.back().back() / errors[0][0]; }

 private:
  static std::pair<std::size_t, double> place_of(double share) {
    const double place = std::clamp(share, 0.0, 1.0) * (kShares - 1);
    const std::size_t below = std::min(static_cast<std::size_t>(place), kShares - 2);
    return {below, place - static_cast<double>(below)};
  }
};

// ln of the depths that a frame has at the true ones' places, with so much of the relief kept; NaN
// where it has none.
std::vector<double> log_depths(const ReliefScene& scene, const PreparedFrame& frame,
                               Plane log_range, const ReliefShare& kept) {
  const RayGrid rays = ray_grid(frame.camera);
  keep_relief(rays, frame.tissue, kept, log_range);
  const Plane depth = depth_from_log_range(log_range, rays, frame.tissue);
  std::vector<double> logs;
  for (const SeenPoint& point : scene.truth) {
    const float found =
        depth_between(depth, project(frame.camera, unproject(scene.camera, point.pixel)));
    logs.push_back(std::isfinite(found) ? std::log(double(found)) : std::nan(""));
  }
  return logs;
}

Judged judged(const ReliefScene& scene) {
  const PreparedFrame frame = prepare_frame(scene.picture, scene.camera, scene.frame);
  const FrameDepth depth = shade_frame(frame, scene.shading);
  Judged result{relief_evidence(frame, depth.range), depth.quality.kept};
  // Shares are of ln z: three reliefs tell all.
  const auto logs = [&](const ReliefShare& kept) {
    return log_depths(scene, frame, depth.range.log_range, kept);
  };
  const std::vector<double> plane = logs({}), tilted = logs({.tilt = 1}), rest = logs({.rest = 1});
  for (std::size_t i = 0; i < kShares; ++i)
    for (std::size_t j = 0; j < kShares; ++j) {
      const double of_tilt = double(i) / (kShares - 1), of_rest = double(j) / (kShares - 1);
      DepthPairs pairs;
      for (std::size_t k = 0; k < plane.size(); ++k)
        pairs.add(static_cast<float>(std::exp(plane[k] + of_tilt * (tilted[k] - plane[k]) +
                                              of_rest * (rest[k] - plane[k]))),
                  scene.truth[k].depth);
      result.errors[i][j] = agreement_of(pairs).mean_percent;
    }
  return result;
}

// Mean over the scenes, with a penalty on those that are clearly worse than a plane, so heavy that
// it is a bound.
double cost_of(const ReliefShareModel& model, const std::vector<Judged>& scenes) {
  constexpr double kHarmless = 1.08, kPenalty = 60, kShrink = 1e-4;
  double sum = 0;
  for (const Judged& scene : scenes) {
    const double ratio = scene.ratio(relief_share(scene.evidence, model));
    sum += ratio + kPenalty * std::max(0.0, ratio - kHarmless);
  }
  double size = 0;
  for (const ReliefShareTerms* terms : {&model.tilt, &model.rest})
    for (const double coefficient : *terms) size += coefficient * coefficient;
  return sum / static_cast<double>(scenes.size()) + kShrink * size;
}

// Tries a coefficient a step up and down; keeps what costs less.
void improve(double& coefficient, double step, ReliefShareModel& model, double& least,
             const std::vector<Judged>& scenes) {
  for (const double move : {step, -step}) {
    coefficient += move;
    if (const double cost = cost_of(model, scenes); cost < least) {
      least = cost;
      return;
    }
    coefficient -= move;
  }
}

// Compass search (Hooke & Jeeves 1961): the cost has kinks, and eight coefficients are few.
ReliefShareModel fitted(const std::vector<Judged>& scenes) {
  constexpr double kFirstStep = 1, kLastStep = 0.01;
  ReliefShareModel model = {};
  double least = cost_of(model, scenes);
  for (double step = kFirstStep; step > kLastStep;) {
    const double before = least;
    for (ReliefShareTerms* terms : {&model.tilt, &model.rest})
      for (double& coefficient : *terms) improve(coefficient, step, model, least, scenes);
    if (!(least < before)) step /= 2;
  }
  return model;
}

std::string text_of(const ReliefShareTerms& terms) {
  std::string text;
  for (const double coefficient : terms)
    text += (text.empty() ? "" : ", ") + to_text(coefficient, 2);
  return "{" + text + "}";
}

void refit(Bench& bench) {
  std::vector<Judged> scenes;
  for (int i = 0; i < kFittedScenes; ++i) {
    bench.now("relief: scene " + std::to_string(i + 1) + " of " + std::to_string(kFittedScenes));
    scenes.push_back(judged(seeded_relief_scene(kFirstFitted + i)));
  }
  const ReliefShareModel model = fitted(scenes);
  bench.now("relief: kReliefShareModel = {" + text_of(model.tilt) + ", " + text_of(model.rest) +
            "}; cost " + to_text(cost_of(kReliefShareModel, scenes), 4) + " before, " +
            to_text(cost_of(model, scenes), 4) + " after");
}

// Each scene's error by the plane's.
void promise(Bench& bench, const std::string& what, const std::vector<Judged>& scenes,
             double most_on_average) {
  double sum = 0, worst = 0, full = 0, full_worst = 0, least = 0;
  for (const Judged& scene : scenes) {
    const double ratio = scene.ratio(scene.kept);
    bench.point(what, "organbake", {}, {{"depth error by a plane's", "×", ratio}},
                {{"share kept of the tilt", "", scene.kept.tilt},
                 {"of the rest", "", scene.kept.rest},
                 {"unexplained", "", scene.evidence.unexplained},
                 {"plane", "%", scene.errors[0][0]},
                 {"full relief", "×", scene.full_ratio()}});
    sum += ratio, full += scene.full_ratio(), least += scene.least_ratio();
    worst = std::max(worst, ratio), full_worst = std::max(full_worst, scene.full_ratio());
  }
  const auto count = static_cast<double>(scenes.size());
  bench.now(what + ": " + to_text(sum / count, 3) + " on average, " + to_text(worst, 3) +
            " at worst; all relief would be " + to_text(full / count, 2) + ", " +
            to_text(full_worst, 2) + "; the best shares of each scene by itself " +
            to_text(least / count, 3));
  bench.at_most(what + ": depth error by a plane's, mean", "×", sum / count, most_on_average);
  bench.at_most(what + ": depth error by a plane's, the worst", "×", worst, 1.1);
}

void run_relief(Bench& bench) {
  if (bench.options().only == "refit") return refit(bench);
  std::vector<Judged> seeded, clip;
  for (int i = 0; i < bench.count(4, 60, 60); ++i) {
    bench.now("relief: seed " + std::to_string(kFirstTested + i));
    seeded.push_back(judged(seeded_relief_scene(kFirstTested + i)));
  }
  promise(bench, "seeded scenes", seeded, 0.9);
  const auto video = bench.data("video/laparoscopy_720p_25fps.mp4");
  const auto model = bench.data("video/colmap_model");
  if (video.empty() || model.empty()) return;
  bench.now("relief: the shared video");
  for (const ReliefScene& scene : clip_relief_scenes(video, model, bench.count(2, 10, 10)))
    clip.push_back(judged(scene));
  // The plane is as good as a single frame's shading gets here: its hues are its brightness. Even
  // the best shares of each frame, which only its truth tells, leave 0.92 of the plane's error.
  promise(bench, "shared video against COLMAP's points", clip, 1.02);
}

const RegisteredPart kRelief(
    "relief", run_relief,
    "how much relief shading may keep: depth error by a plane's; --only refit fits the model");

}  // namespace
}  // namespace organbake
