// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/video_reader.h"
#include "suites/shading_parts.h"

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
        if (!frame.counts.values[k] || !std::isfinite(truth.depth_mm.values[k])) continue;
        const double ratio = std::log(depth.depth.values[k] / truth.depth_mm.values[k]);
        shift += pass == 0 ? ratio : 0;
        count += pass == 0;
        sum += pass == 1 ? std::abs(std::exp(ratio - shift / count) - 1) : 0;
      }
    for (std::size_t k = 0; k < depth.depth.size(); ++k) {
      if (!frame.field.values[k] || truth.instrument.values[k]) continue;
      const bool masked = !frame.counts.values[k];
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

LaparoscopyOptions clip_options(const Bench& bench, int frames) {
  LaparoscopyOptions options{.frames = frames};
  if (bench.quick()) options.width = 320, options.height = 240;
  return options;
}

void phantom_clip(Bench& bench) {
  bench.now("phantom laparoscopy");
  const int frames = bench.count(2, 4, 8);
  const LaparoscopyPhantom phantom(clip_options(bench, frames));
  const ClipShares shares = measure_clip(phantom, frames, true);
  bench.add(Figure{"phantom clip: relative error on unmasked tissue", "%", shares.error, 3});
  bench.add(
      Figure{"phantom clip: highlights masked", "%", shares.recall, 90, Figure::Goal::at_least});
  bench.add(Figure{"phantom clip: clean tissue masked", "%", shares.false_alarm, 5});
}

// What bringing two tissues to one albedo is worth, where there are two and where there is one.
void phantom_tissues(Bench& bench) {
  const int frames = bench.count(1, 2, 4);
  for (const bool two : {true, false}) {
    LaparoscopyOptions options = clip_options(bench, frames);
    options.two_tissues = two;
    const LaparoscopyPhantom phantom(options);
    for (const bool piecewise : {true, false}) {
      bench.now(two ? "phantom of two tissues" : "phantom of one tissue");
      const ClipShares shares = measure_clip(phantom, frames, piecewise);
      bench.add(Point{two ? "phantom clip, two tissues" : "phantom clip, one tissue",
                      piecewise ? "albedo by tissue" : "one albedo",
                      false,
                      {{"frames", "", double(frames)}},
                      {},
                      {{kRangeError, "%", shares.error}}});
    }
  }
}

// Decoding, masks and shading; what the stage writes is measured by running the stage.
void real_clip(Bench& bench) {
  const std::filesystem::path path = bench.data("video/laparoscopy_720p_25fps.mp4");
  if (path.empty()) return;
  bench.now("real clip");
  const int most = bench.count(8, 25, 50);
  int frames = 0;
  const Timing timing = bench.time([&] {
    VideoReader reader(path);
    StoredPicture image;
    FrameDepth previous;
    for (frames = 0; frames < most && reader.next(image); ++frames) {
      const PreparedFrame frame = prepare_frame(
          image, assumed_camera(image.color.width, image.color.height, 1.22), {.halvings = 1});
      previous = shade_frame(frame, {}, frames > 0 ? &previous : nullptr);
    }
  });
  bench.add(Figure{"real clip at half size, one thread, without writing: rate", "frames/s",
                   1000.0 * frames / timing.wall_ms.median, 5, Figure::Goal::at_least});
  bench.add(Figure{"real clip: memory", "MB", timing.peak_mb, 400});
}

}  // namespace

void promise_clips(Bench& bench) {
  phantom_clip(bench);
  phantom_tissues(bench);
  real_clip(bench);
}

}  // namespace organbake
