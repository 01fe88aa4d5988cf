// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/phantom/run_moving_clip.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/png.h"
#include "organbake/image/video_pipe.h"
#include "stages/phantom/clip_files.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr int kTruthEvery = 5;   // frames
constexpr int kAtOnce = 4;       // frames that are drawn and written side by side
constexpr double kDrawn = 0.95;  // share of the work

// Where the frames go, in their order.
class FrameWriter {
 public:
  FrameWriter(const fs::path& folder, const LaparoscopyOptions& view, double bit_rate_mbps)
      : frames_(folder / "frames") {
    if (bit_rate_mbps == 0) {
      make_folder(frames_);
    } else {
      video_.emplace(folder / "clip.mp4", VideoFormat{view.width, view.height,
                                                      MovingClip::kFramesPerSecond, bit_rate_mbps});
    }
  }
  // Any number at once, in any order; what a video takes is kept until add().
  void write(int index, const Rgb8Image& image) const {
    if (!video_) write_png(frames_ / (frame_number(index) + ".png"), image, 1);
  }
  void add(const Rgb8Image& image) {
    if (video_) video_->add(image);
  }
  void finish() {
    if (video_) video_->finish();
  }

 private:
  fs::path frames_;
  std::optional<VideoPipe> video_;
};

std::string frames_csv(const MovingClip& clip, int frames) {
  std::string text = "frame,time_s,breath_mm,blur_px\n";
  for (int i = 0; i < frames; ++i)
    text += std::to_string(i) + "," + to_text(clip.time_s(i)) + "," + to_text(clip.breath_mm(i)) +
            "," + to_text(clip.blur_px(i)) + "\n";
  return text;
}

void write_frames(const MovingClip& clip, const LaparoscopyOptions& view, double bit_rate_mbps,
                  const StageCall& call) {
  FrameWriter writer(call.output_folder, view, bit_rate_mbps);
  for (int first = 0; first < view.frames; first += kAtOnce) {
    std::vector<Rgb8Image> images(std::min(kAtOnce, view.frames - first));
    parallel_for(std::size_t{0}, images.size(), [&](std::size_t i) {
      const int index = first + static_cast<int>(i);
      LaparoscopyFrame frame = clip.frame(index, call.context);
      writer.write(index, frame.image);
      if (index % kTruthEvery == 0)
        write_frame_truth(call.output_folder / "truth" / (frame_number(index) + ".exr"), frame);
      images[i] = std::move(frame.image);
    });
    for (const Rgb8Image& image : images) writer.add(image);
    call.context.progress(kDrawn * std::min(first + kAtOnce, view.frames) / view.frames);
  }
  writer.finish();
}

}  // namespace

StageReport run_moving_clip(const PhantomStageOptions& options, const StageCall& call) {
  const MovingClipOptions asked = options.moving_clip();
  const MovingClip clip(asked);
  const fs::path truth = call.output_folder / "truth";
  make_folder(truth);
  write_frames(clip, asked.view, options.bit_rate_mbps, call);
  CameraSet set;
  for (int i = 0; i < asked.view.frames; ++i) set.cameras.push_back(clip.camera(i));
  write_file_atomically(call.output_folder / "cameras.json", cameras_to_json(set));
  write_file_atomically(truth / "frames.csv", frames_csv(clip, asked.view.frames));
  write_ply(truth / "surface.ply", clip.surface());
  write_file_atomically(call.output_folder / "phantom.json", phantom_json(call.options_json));
  StageReport report;
  report.add("frames", asked.view.frames);
  report.add("path", options.path);
  return report;
}

}  // namespace organbake
