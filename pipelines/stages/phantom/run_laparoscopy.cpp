// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/phantom/run_laparoscopy.h"

#include <filesystem>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/image/png.h"
#include "stages/phantom/clip_files.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// The eyes of the first frame, whose places to each other all frames have.
void write_right_eye(const LaparoscopyPhantom& phantom, int frames, const StageCall& call) {
  const fs::path folder = call.output_folder / "right";
  make_folder(folder);
  for (int i = 0; i < frames; ++i) {
    call.context.throw_if_cancelled();
    write_png(folder / (frame_number(i) + ".png"), phantom.right_frame(i).image, 1);
  }
  CameraSet eyes;
  eyes.cameras = {phantom.camera(0), phantom.right_camera(0)};
  eyes.cameras[0].name = "left";
  eyes.cameras[1].name = "right";
  write_file_atomically(call.output_folder / "stereo.json", cameras_to_json(eyes));
}

void refuse_options_of_paths(const PhantomStageOptions& options) {
  if (options.clip.breathing_mm > 0 || options.clip.blurred > 0 || options.bit_rate_mbps > 0)
    throw UsageError(
        "path = sway: breathing, blurred and bit_rate belong to a clip along a path; choose one, "
        "such as --path tour, or leave them out");
}

}  // namespace

StageReport run_laparoscopy(const PhantomStageOptions& options, const StageCall& call) {
  refuse_options_of_paths(options);
  const LaparoscopyOptions asked = options.view();
  const LaparoscopyPhantom phantom(asked);
  const fs::path frames = call.output_folder / "frames", truth = call.output_folder / "truth";
  make_folder(frames);
  make_folder(truth);
  CameraSet set;
  for (int i = 0; i < asked.frames; ++i) {
    call.context.throw_if_cancelled();
    const LaparoscopyFrame frame = phantom.frame(i);
    write_png(frames / (frame_number(i) + ".png"), frame.image, 1);
    write_frame_truth(truth / (frame_number(i) + ".exr"), frame);
    set.cameras.push_back(frame.camera);
    call.context.progress((i + 1.0) / asked.frames);
  }
  if (asked.baseline_mm > 0) write_right_eye(phantom, asked.frames, call);
  write_file_atomically(call.output_folder / "cameras.json", cameras_to_json(set));
  write_file_atomically(call.output_folder / "phantom.json", phantom_json(call.options_json));
  StageReport report;
  report.add("frames", asked.frames);
  report.add("light_offset_mm", asked.light_offset_x_mm);
  return report;
}

}  // namespace organbake
