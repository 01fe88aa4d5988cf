// SPDX-License-Identifier: Apache-2.0
#pragma once

// What a window shows beside the organ: where its panels lie, and the bundles that it may open.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

// Which of the window's panels are unfolded. A folded one is a narrow strip along its edge.
struct OpenPanels {
  bool tools = true, readings = true, timeline = true;

  bool operator==(const OpenPanels&) const = default;
};

// Where panels lie along the edges of a window, and what they leave to the organ: together they
// fill the window, and no two overlap.
struct PanelLayout {
  PixelRect tools, readings, timeline, organ;
  OpenPanels open;  // as far as there is room: the organ keeps kLeastOrgan_px of width
};

inline constexpr int kLeastOrgan_px = 320;  // at scale 1

// How much larger than usual letters and panels of a window are: 1 up to full HD, 2 on 4K, or what
// the screen asks for.
double panel_scale(const Eigen::Vector2i& window_px, double screen_scale);

// wanted: which to unfold; where not both sides fit, `prefer_readings` tells which does.
PanelLayout lay_out_panels(const Eigen::Vector2i& window_px, double scale, const OpenPanels& wanted,
                           bool prefer_readings);

struct ListedFolder {
  std::string name;
  bool is_bundle = false;
};

// The folders within one, bundles first, each kind by name; hidden ones are left out. Empty where
// the folder cannot be read.
std::vector<ListedFolder> list_folders(const std::filesystem::path& folder);

}  // namespace organbake
