// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <thread>

#include "bench.h"
#include "measuring/frame_timing.h"
#include "measuring/player_bundles.h"
#include "organbake/core/parallel.h"
#include "organbake/core/stopwatch.h"
#include "organbake/core/text.h"
#include "organbake/player/player.h"
#include "organbake/player/skin_point.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kLength_mm = 30, kDepth_mm = 14;
constexpr int kSteps = 120;
constexpr double kStep_ms = 1000.0 / 60;

DeformOptions with_elements() {
  DeformOptions options;
  options.solver = TissueSolver::fem;
  return options;
}

// A scalpel on its way across the front; turned, by as much, about the middle.
Instrument blade_at(const Bundle& bundle, double share, double turn_rad = 0) {
  const Vector3d out = bundle.cameras.manifold.directions.front().normalized();
  const Vector3d side =
      Eigen::AngleAxisd(turn_rad, out) * out.cross(Vector3d::UnitZ()).normalized();
  const Vector3d middle = skin_point(bundle, out) - bundle.cameras.manifold.center_world_mm;
  Instrument tip;
  tip.active = true;
  tip.kind = Blade{};
  tip.radius_mm = 0.4;
  tip.position_mm = skin_point(bundle, (middle + kLength_mm * (share - 0.5) * side).normalized()) -
                    kDepth_mm * out;
  tip.axis_mm = 2 * kDepth_mm * out;
  return tip;
}

double step_ms(Player& player, const std::vector<Instrument>& tips) {
  Stopwatch watch;
  player.step(tips);
  return watch.lap();
}

// A step every sixtieth of a second until a time from `start` on.
void wait_for(const std::chrono::steady_clock::time_point& start, int step) {
  std::this_thread::sleep_until(start + step * std::chrono::duration<double, std::milli>(kStep_ms));
}

// In a window: twenty cuts that cross, half a second each, where none may make a picture wait.
void promise_many(Bench& bench, Player& player) {
  constexpr int kCuts = 20, kStepsOfCut = 30, kRest = 12;
  player.reset();
  player.set_cut_times(Player::CutTimes{});
  const int cuts = bench.quick() ? 3 : kCuts;
  std::vector<double> all;
  const auto start = std::chrono::steady_clock::now();
  int step = 0;
  for (int cut = 0; cut < cuts; ++cut) {
    double longest = 0;
    for (int i = 0; i < kStepsOfCut + kRest; ++i) {
      std::vector<Instrument> tips;
      if (i <= kStepsOfCut)
        tips.push_back(blade_at(player.bundle(), double(i) / kStepsOfCut, 2.4 * cut));
      all.push_back(step_ms(player, tips));
      longest = std::max(longest, all.back());
      wait_for(start, ++step);
    }
    bench.now("cut " + std::to_string(cut + 1) + ": longest step " + to_text(longest, 1) + " ms");
  }
  player.set_cut_times(std::nullopt);
  const std::string what = std::to_string(cuts) + " cuts that cross, in a window, " +
                           std::to_string(player.bundle_now().mechanics.body->tetrahedra.size()) +
                           " tetrahedra in the end: ";
  std::sort(all.begin(), all.end());
  bench.at_most(what + "a step, median", "ms", all[all.size() / 2], 5);
  bench.at_most(what + "a step, 99th percentile", "ms", all[all.size() * 99 / 100], 5);
  bench.at_most(what + "the longest step", "ms", all.back(), 5);
}

// As it is seen: a step every sixtieth of a second, with a thread to spare for what parts.
void promise_growth(Bench& bench, Player& player) {
  std::vector<double> growing, others;
  std::size_t faces = 0;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i <= kSteps + 2 * Player::kCutDelaySteps; ++i) {
    std::vector<Instrument> tips;
    if (i <= kSteps) tips.push_back(blade_at(player.bundle(), double(i) / kSteps));
    const double ms = step_ms(player, tips);
    const std::size_t now = player.bundle_now().proxy.faces.size();
    (now != faces ? growing : others).push_back(ms);
    faces = now;
    wait_for(start, i + 1);
  }
  growing.erase(growing.begin());  // the first is the whole organ's
  const std::string what = "a blade through the phantom at 60 steps a second, a cut of 30 mm, " +
                           std::to_string(player.bundle_now().mechanics.body->tetrahedra.size()) +
                           " tetrahedra in the end: ";
  bench.at_most(what + "the step in which it grows, median", "ms", spread_of(growing).median, 5);
  bench.at_most(what + "the others, median", "ms", spread_of(others).median, 5);
}

void promise_frames_of_cut(Bench& bench, Player& cut, Player& whole) {
  const FrameSize size{1280, 720};
  Frame frames[2];
  int turn = 0;
  const auto draw = [&](Player& player, Frame& frame) {
    for (int i = 0; i < kFrames; ++i)
      player.draw(view_at(player.bundle(), size, i + turn), {}, frame);
  };
  const ThreadLimit one(1);
  const auto timings = bench.time({[&] { draw(whole, frames[0]); }, [&] { draw(cut, frames[1]); }});
  bench.at_most("frame of 720p, one thread: the organ cut / whole", "×",
                timings[1].cpu_ms.median / timings[0].cpu_ms.median, 1.15);
}

void run_cutting(Bench& bench) {
  PlayerBundles bundles(bench.scratch(), bench.context(), bench.quick());
  const auto folder = bundles.folder({80, "fitted", bundles.map_size(), true});
  bench.now("a blade through the phantom");
  Player cut(folder, with_elements()), whole(folder, with_elements());
  promise_growth(bench, cut);
  promise_frames_of_cut(bench, cut, whole);
  promise_many(bench, cut);
}

const RegisteredPart kCutting("cutting", run_cutting,
                              "blades: the step in which a cut grows, and frames of what was cut");

}  // namespace
}  // namespace organbake
