// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "command_line.h"
#include "organbake/deform/deformer.h"
#include "organbake/player/orbit.h"
#include "organbake/truth/pixel_truth.h"
#include "organbake/warp/draw_options.h"
#include "window/run_window.h"

namespace organbake {

struct PictureSize {
  int width = 1280, height = 720;  // pixels
};

// What the user asked for.
struct Command {
  std::vector<std::filesystem::path> bundles;  // several: organs that push each other
  std::filesystem::path script, dataset, out_folder, video, report, sheet, frame_file, reference;
  std::filesystem::path lens;     // of a scope, that the pictures are shown through
  std::filesystem::path cameras;  // to look from, in the view's or the script's place
  OrbitPose view;
  std::optional<double> distance_mm;  // from the tissue in its middle, instead of the view's own
  LayerSet layers;                    // beside the frames
  // From the left eye to the right one: of the truth, and of one picture of both.
  std::optional<double> stereo_mm, eyes_mm;
  std::optional<PictureSize> size;       // else the script's, or what is usual where it is shown
  std::optional<PictureSize> lens_size;  // of the lens, once it is read
  bool instruments = true;
  bool paper_warp = false;
  bool cavity = true;  // behind the organ, where it is lit from a scope
  DrawnBy drawn_by = DrawnBy::automatic;
  std::optional<DrawnLight> light;     // else the script's, or what the organ is meant for
  std::optional<TissueSolver> solver;  // else the script's, or what the organs have
  bool compare = false;
  std::vector<double> angles_rad;
  int bench_frames = 0;
  double threshold_db = 45;
  SharedFlags shared;
  std::vector<std::string> notes;  // what is to be said of options that are no longer there

  bool wants_truth() const { return layers.any() || stereo_mm; }
  PictureSize picture_size() const { return size.value_or(lens_size.value_or(PictureSize())); }
  // Nothing that can be done without a display was asked for.
  bool wants_window() const;
};

// Throws UsageError. When help, the version or a manual was asked for, prints it and returns
// nothing.
std::optional<Command> read_command(int argc, char** argv);

}  // namespace organbake
