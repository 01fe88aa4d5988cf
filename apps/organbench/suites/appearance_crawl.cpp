// SPDX-License-Identifier: GPL-3.0-or-later
// Whether the look of tissue crawls, flickers or jumps while a scope comes near and while a tool
// pokes: each frame's step to the next, block by block, against that of the same frames drawn with
// sixteen pixels for one, in which what is too fine for a pixel cannot flicker.
#include <algorithm>
#include <cmath>
#include <functional>

#include "bench.h"
#include "measuring/material_bundle.h"
#include "measuring/scope_views.h"
#include "organbake/evaluation/frame_errors.h"
#include "organbake/image/srgb.h"
#include "organbake/player/player.h"

namespace organbake {
namespace {

constexpr int kCrawlWidth_px = 320;

// The mean light of the pixels that lie in each pixel of a picture a quarter as wide.
TruthFrame supersampled(const Frame& fine) {
  constexpr int kSide = TruthFrame::kRaysPerSide;
  const auto& linear = linear_from_srgb8();
  const int width = fine.color.width / kSide, height = fine.color.height / kSide;
  TruthFrame truth{Rgb8Image(width, height), {}, {}, {}};
  truth.covered.assign(std::size_t(width) * height, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      std::uint8_t& covered = truth.covered[std::size_t(y) * width + x];
      for (int k = 0; k < TruthFrame::kRaysPerPixel; ++k) {
        const int u = kSide * x + k % kSide, v = kSide * y + k / kSide;
        for (int c = 0; c < 3; ++c) sum[c] += linear[fine.color.at(u, v)[c]];
        covered += fine.cover[std::size_t(v) * fine.color.width + u] != Cover::background;
      }
      for (int c = 0; c < 3; ++c)
        truth.color.at(x, y)[c] = srgb8_from_linear(sum[c] / TruthFrame::kRaysPerPixel);
    }
  return truth;
}

// Draws frame after frame, each twice, and promises the largest step beyond the truth's.
class CrawlWatch {
 public:
  CrawlWatch(Player& player, const ScopeAim& aim) : player_(player), aim_(aim) {
    options_.light = player.default_light();
  }

  void frame_at(double range_mm) {
    Frame frame, fine;
    player_.draw(scope_view(aim_, range_mm, kCrawlWidth_px), options_, frame);
    player_.draw(scope_view(aim_, range_mm, TruthFrame::kRaysPerSide * kCrawlWidth_px), options_,
                 fine);
    TruthFrame truth = supersampled(fine);
    if (!before_.pixels.empty()) {
      const SeamSteps steps = switch_steps(before_, frame.color, truth_before_, truth);
      if (steps.excess > largest_) largest_ = steps.excess, where_mm_ = range_mm;
    }
    before_ = std::move(frame.color);
    truth_before_ = std::move(truth);
  }
  void promise(Bench& bench, const std::string& what) const {
    constexpr double kMost_percent = 1.5;
    bench.at_most(what + ": largest step of 8 × 8 pixels beyond the supersampled truth's, from " +
                      std::to_string(std::lround(where_mm_)) + " mm",
                  "% of full scale", 100 * largest_ / 255, kMost_percent);
  }

 private:
  Player& player_;
  const ScopeAim aim_;
  DrawOptions options_;
  Rgb8Image before_;
  TruthFrame truth_before_;
  double largest_ = 0, where_mm_ = 0;
};

void watch_approach(Bench& bench, Player& player, const ScopeAim& aim, int frames) {
  constexpr double kFar_mm = 100, kNear_mm = 25;
  CrawlWatch watch(player, aim);
  for (int k = 0; k < frames; ++k)
    watch.frame_at(kFar_mm + (kNear_mm - kFar_mm) * k / (frames - 1));
  watch.promise(bench, std::to_string(frames) + " frames of an approach from 100 to 25 mm");
}

void watch_poke(Bench& bench, Player& player, const ScopeAim& aim, int frames) {
  constexpr double kRange_mm = 50, kDeepest_mm = 10, kRadius_mm = 4;
  CrawlWatch watch(player, aim);
  for (int k = 0; k < frames; ++k) {
    const double deep_mm = kDeepest_mm * k / (frames - 1);
    player.step({{.position_mm = aim.point_mm + (kRadius_mm - deep_mm) * aim.normal,
                  .radius_mm = kRadius_mm,
                  .active = true}});
    watch.frame_at(kRange_mm);
  }
  player.reset();
  watch.promise(bench, std::to_string(frames) + " frames of a poke of 10 mm");
}

void run_crawl(Bench& bench) {
  if (!bench.wants("crawl")) return;
  bench.now("crawl");
  const std::filesystem::path bundle = material_bundle(bench, "liver", "liver");
  if (bundle.empty()) return;
  Player player(bundle);
  const ScopeAim aim = scope_aim(player.bundle().proxy, {-0.2, -1, 0.1});
  const int frames = bench.count(40, 200, 200);
  watch_approach(bench, player, aim, frames);
  watch_poke(bench, player, aim, frames);
}

const RegisteredPart kCrawl("appearance", run_crawl);

}  // namespace
}  // namespace organbake
