// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "measuring/eye_pair.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/frame_depth.h"
#include "promises.h"

namespace organbake {
namespace {

struct ClipShares {
  double error = 0, recall = 0, false_alarm = 0;
};

ClipShares measure_clip(const LaparoscopyPhantom& phantom, int frames, bool piecewise_albedo) {
  ClipShares mean;
  FrameDepth previous;
  for (int i = 0; i < frames; ++i) {
    const LaparoscopyFrame truth = phantom.frame(i);
    const PreparedFrame frame =
        prepare_frame(truth.image, truth.camera.intrinsics, {.piecewise_albedo = piecewise_albedo});
    FrameDepth depth = shade_frame(frame, {}, i > 0 ? &previous : nullptr);
    double shift = 0, count = 0, sum = 0, lights = 0, hit = 0, clean = 0, taken = 0;
    for (int pass = 0; pass < 2; ++pass)
      for (std::size_t k = 0; k < depth.depth.size(); ++k) {
        if (!frame.diffuse.values[k] || !std::isfinite(truth.depth_mm.values[k])) continue;
        const double ratio = std::log(depth.depth.values[k] / truth.depth_mm.values[k]);
        shift += pass == 0 ? ratio : 0;
        count += pass == 0;
        sum += pass == 1 ? std::abs(std::exp(ratio - shift / count) - 1) : 0;
      }
    for (std::size_t k = 0; k < depth.depth.size(); ++k) {
      if (!frame.field.values[k] || truth.instrument.values[k]) continue;
      const bool masked = !frame.diffuse.values[k];
      (truth.highlights.values[k] ? lights : clean) += 1;
      (truth.highlights.values[k] ? hit : taken) += masked;
    }
    mean.error += 100 * sum / count / frames;
    mean.recall += 100 * hit / std::max(1.0, lights) / frames;
    mean.false_alarm += 100 * taken / std::max(1.0, clean) / frames;
    previous = std::move(depth);
  }
  return mean;
}

TEST(LaparoscopyClip, IsShadedWhereItIsTissue) {
  const int frames = cases(4, 8);
  const ClipShares shares =
      measure_clip(LaparoscopyPhantom(LaparoscopyOptions{.frames = frames}), frames, true);
  expect({"phantom clip: relative error on unmasked tissue", "%", shares.error, 3});
  expect({"phantom clip: highlights masked", "%", shares.recall, 90, Figure::Goal::at_least});
  expect({"phantom clip: clean tissue masked", "%", shares.false_alarm, 5});
}

// What bringing two tissues to one albedo is worth, where there are two and where there is one.
TEST(LaparoscopyClip, OfTwoTissuesIsBetterShadedTissueByTissue) {
  const int frames = cases(2, 4);
  for (const bool two : {true, false}) {
    const LaparoscopyPhantom phantom({.frames = frames, .two_tissues = two});
    const double by_tissue = measure_clip(phantom, frames, true).error;
    const double as_one = measure_clip(phantom, frames, false).error;
    const std::string what = two ? "phantom clip, two tissues: " : "phantom clip, one tissue: ";
    report(what + "relative depth error, one albedo", "%", as_one);
    expect({what + "relative depth error, albedo by tissue", "%", by_tissue,
            two ? as_one : 1.1 * as_one});
  }
}

// What of the left picture lies in the right eye's view, too, by the true depths: its round field
// misses a tenth of the left one's at 40…100 mm, and each eye looks past the instrument otherwise.
Mask seen_by_both(const EyePair& pair) {
  constexpr float kOneSurface = 0.03F;  // of the depth
  const RectifiedEyes& eyes = pair.rectifier.eyes();
  const Plane &left = pair.left.depth_mm, &right = pair.right.depth_mm;
  Mask both(left.width, left.height);
  for (int y = 0; y < left.height; ++y)
    for (int x = 0; x < left.width; ++x) {
      const double disparity =
          eyes.disparity_at_infinity + eyes.camera.fx * eyes.baseline_mm / left.at(x, y);
      const auto column = static_cast<int>(std::lround(x - disparity));
      if (!std::isfinite(left.at(x, y)) || column < 0) continue;
      both.at(x, y) =
          std::abs(right.at(column, y) / left.at(x, y) - 1) < kOneSurface;  // inf: not in view
    }
  return both;
}

TEST(StereoLaparoscope, TellsDistancesOfMostTissue) {
  const int scenes = cases(3, 8);
  double mean = 0, bad = 0, dense = 0;
  for (int seed = 1; seed <= scenes; ++seed) {
    const EyePair pair(720, 576, seed);
    Mask tissue;
    const StereoDepth found = pair.matched(&tissue);
    const Mask in_both = seen_by_both(pair);
    double sum = 0, off = 0, count = 0, all = 0, told = 0;
    for (std::size_t k = 0; k < tissue.size(); ++k) {
      const double truth = pair.left.depth_mm.values[k];
      if (!tissue.values[k] || !std::isfinite(truth)) continue;
      const bool has_depth = std::isfinite(found.depth.depth.values[k]);
      all += in_both.values[k];
      told += in_both.values[k] && has_depth;
      if (!has_depth) continue;
      const double relative = std::abs(found.depth.depth.values[k] / truth - 1);
      sum += relative;
      off += relative > 0.03;
      ++count;
    }
    mean += 100 * sum / std::max(1.0, count) / scenes;
    bad += 100 * off / std::max(1.0, count) / scenes;
    dense += 100 * told / std::max(1.0, all) / scenes;
  }
  expect({"stereo, phantom at 40…100 mm: relative error, metric", "%", mean, 1});
  expect({"stereo, phantom: pixels off by more than 3 %", "%", bad, 3});
  expect({"stereo, phantom: tissue in both views with a depth", "%", dense, 95,
          Figure::Goal::at_least});
}

}  // namespace
}  // namespace organbake
