// SPDX-License-Identifier: GPL-3.0-or-later
// Stereo pairs from clean to hopeless: whether the verdict tells the right depths from the wrong
// ones, what the masks take from tissue, and what pictures lose on bad days.
#include <algorithm>

#include "bench.h"
#include "measuring/stereo_cases.h"
#include "organbake/core/random.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr int kWidth_px = 400, kHeight_px = 320;
constexpr int kFirstScene = 101;  // the verdict's limits were set on scenes 1 to 13

double percent(int part, int whole) { return whole > 0 ? 100.0 * part / whole : 100; }

// Each kind of every scene, of any strength.
void verdicts(Bench& bench) {
  const int scenes = bench.count(2, 13, 40);
  const std::vector<std::string>& kinds = StereoCases::kinds();
  int right = 0, right_ok = 0, wrong = 0, wrong_ok = 0;
  for (int scene = kFirstScene; scene < kFirstScene + scenes; ++scene) {
    bench.now("stereo verdicts, scene " + std::to_string(scene));
    const StereoCases cases(static_cast<std::uint64_t>(scene), kWidth_px, kHeight_px,
                            scene % 4 == 3);
    RandomStream random(static_cast<std::uint64_t>(scene), 99);
    for (const std::string& kind : kinds) {
      const StereoCases::Outcome outcome = cases.outcome(kind, random.uniform(0, 1));
      const bool ok = outcome.verdict == DepthVerdict::ok;
      right += outcome.right();
      right_ok += outcome.right() && ok;
      wrong += outcome.wrong();
      wrong_ok += outcome.wrong() && ok;
    }
  }
  const std::string of = " of " + std::to_string(scenes * static_cast<int>(kinds.size()));
  bench.at_least("depth within 2 % over 60 % of the tissue, called ok, of" + of, "%",
                 percent(right_ok, right), 95);
  bench.at_most("depth off by more than 5 %, called ok," + of, "", wrong_ok, 0);
  bench.at_least("pairs of either kind that tell, in all", "", right + wrong, 0.5 * scenes);
}

// What the changes of a day take, beside the clean pair.
void bad_days(Bench& bench) {
  struct Day {
    std::string kind;
    double strength;
    bool keeps_error = true;  // what is corrected by features errs by theirs
  };
  const Day days[] = {{"pale", 0.5},
                      {"smoke", 0.3 / 0.95},
                      {"vignette", 0.5},
                      {"right eye darker", 0.5},
                      {"rows apart", 0.375, false},
                      {"rolled", 0.518, false}};
  const int scenes = bench.count(2, 10, 40);
  double masked = 0, least_iou = 1;
  std::vector<double> least_covered(std::size(days), 1), most_error(std::size(days), 0);
  for (int scene = 1; scene <= scenes; ++scene) {
    bench.now("stereo on bad days, scene " + std::to_string(scene));
    const bool tool = scene % 2 == 0;
    const StereoCases cases(static_cast<std::uint64_t>(scene), kWidth_px, kHeight_px, tool);
    const StereoCases::Outcome clean = cases.outcome("clean", 0);
    if (tool) least_iou = std::min(least_iou, clean.instrument_iou);
    masked = std::max(masked, clean.masked);
    for (std::size_t i = 0; i < std::size(days); ++i) {
      const StereoCases::Outcome outcome = cases.outcome(days[i].kind, days[i].strength);
      masked = std::max(masked, outcome.masked);
      least_covered[i] = std::min(least_covered[i], outcome.covered / clean.covered);
      most_error[i] = std::max(most_error[i], outcome.error / clean.error);
    }
  }
  bench.at_most("tissue taken for instruments, worst pair", "%", 100 * masked, 2);
  bench.at_least("mask of an instrument against the true one, worst pair: IoU", "", least_iou,
                 0.85);
  for (std::size_t i = 0; i < std::size(days); ++i) {
    bench.at_least(days[i].kind + ": covered, of the clean pair's, worst pair", "%",
                   100 * least_covered[i], 95);
    if (!days[i].keeps_error) continue;
    bench.at_most(days[i].kind + ": error, times the clean pair's, worst pair", "", most_error[i],
                  1.2);
  }
}

void run_stereo(Bench& bench) {
  verdicts(bench);
  bad_days(bench);
}

const RegisteredPart kStereo("stereo", run_stereo,
                             "stereo pairs from clean to hopeless: masks, depth and its verdict");

}  // namespace
}  // namespace organbake
