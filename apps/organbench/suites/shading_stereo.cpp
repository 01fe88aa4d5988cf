// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "organbake/phantom/laparoscopy.h"
#include "organbake/stereo/stereo_depth.h"
#include "suites/shading_parts.h"

namespace organbake {
namespace {

// 30°: tissue 40…100 mm away.
LaparoscopyOptions stereo_options(int width, int height, std::uint64_t seed) {
  return {.seed = seed,
          .width = width,
          .height = height,
          .frames = 1,
          .texture = 0.3,
          .tilt_rad = 0.5235987755982988,
          .baseline_mm = 4.5};
}

struct EyePair {
  LaparoscopyFrame left, right;
  Rectifier rectifier;
};

EyePair eye_pair(const LaparoscopyOptions& options) {
  const LaparoscopyPhantom phantom(options);
  const PosedCamera left = phantom.camera(0), right = phantom.right_camera(0);
  return {phantom.frame(0), phantom.right_frame(0),
          Rectifier({left.intrinsics, right.intrinsics,
                     right.camera_from_world * left.camera_from_world.inverse()})};
}

StereoDepth matched(const EyePair& pair, Mask* tissue = nullptr) {
  const RectifiedEyes& eyes = pair.rectifier.eyes();
  const FrameOptions options{.piecewise_albedo = false};
  const PreparedFrame a = prepare_frame(pair.rectifier.left(pair.left.image), eyes.camera, options);
  const PreparedFrame b =
      prepare_frame(pair.rectifier.right(pair.right.image), eyes.right().intrinsics, options);
  if (tissue) *tissue = a.tissue;
  return stereo_depth(a, b, eyes, {});
}

void stereo_errors(Bench& bench) {
  bench.now("stereo laparoscope");
  const int scenes = bench.count(1, 3, 8);
  double mean = 0, bad = 0, dense = 0;
  for (int seed = 1; seed <= scenes; ++seed) {
    const EyePair pair = eye_pair(stereo_options(720, 576, seed));
    Mask tissue;
    const StereoDepth found = matched(pair, &tissue);
    double sum = 0, off = 0, count = 0, all = 0;
    for (std::size_t k = 0; k < tissue.size(); ++k) {
      const double truth = pair.left.depth_mm.values[k];
      if (!tissue.values[k] || !std::isfinite(truth)) continue;
      ++all;
      if (!std::isfinite(found.depth.depth.values[k])) continue;
      const double relative = std::abs(found.depth.depth.values[k] / truth - 1);
      sum += relative;
      off += relative > 0.03;
      ++count;
    }
    mean += 100 * sum / std::max(1.0, count) / scenes;
    bad += 100 * off / std::max(1.0, count) / scenes;
    dense += 100 * count / std::max(1.0, all) / scenes;
  }
  bench.add(Figure{"stereo, phantom at 40…100 mm: relative error, metric", "%", mean, 1});
  bench.add(Figure{"stereo, phantom: pixels off by more than 3 %", "%", bad, 3});
  bench.add(Figure{"stereo, phantom: tissue with a depth", "%", dense, 90, Figure::Goal::at_least});
}

void stereo_rates(Bench& bench) {
  for (const auto& [width, height, target] :
       {std::tuple{720, 576, 5.0}, std::tuple{1280, 720, 2.0}}) {
    const std::string size = std::to_string(width) + "x" + std::to_string(height);
    bench.now("stereo, " + size);
    const EyePair pair = eye_pair(stereo_options(width, height, 1));
    const Timing timing = bench.time([&] { matched(pair); });
    bench.add(Figure{"stereo, " + size + ", without reading and writing: rate", "frames/s",
                     1000 / timing.wall_ms.median, target, Figure::Goal::at_least});
    bench.add(Figure{"stereo, " + size + ": memory", "MB", timing.peak_mb, 600});
  }
}

}  // namespace

void promise_stereo(Bench& bench) {
  stereo_errors(bench);
  stereo_rates(bench);
}

}  // namespace organbake
