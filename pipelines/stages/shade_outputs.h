// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipelines/stage.h"
#include "shading/frame_depth.h"

namespace organbake {

// What the report keeps of a frame.
struct FrameRecord {
  std::size_t index = 0;
  double sharpness = 0;
  bool warm = false, combed = false, metric = false, ambiguous = false;
  bool colourless = false;
  StereoLayout stereo = StereoLayout::none;
  int sweeps = 0, refinements = 0;
  double residual = 0, noise = 0, albedo_span = 1, median_depth = 0, mean_confidence = 0;
  double outside_share = 0, highlight_share = 0, instrument_share = 0;
  std::string branch;
  DepthQuality quality;
};
FrameRecord record_of(std::size_t index, double sharpness, const PreparedFrame& frame,
                      const FrameDepth& depth);

// depth/, normals/, mask/, confidence/ of one frame, named by its index.
void write_frame(const std::filesystem::path& folder, std::size_t index, const PreparedFrame& frame,
                 const FrameDepth& depth);

// Per-frame lists and sums into the report, and the curves over time into plot.svg.
void report_frames(const std::vector<FrameRecord>& records, StageReport& report);
std::string plot_of(const std::vector<FrameRecord>& records);

}  // namespace organbake
