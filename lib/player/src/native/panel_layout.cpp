// SPDX-License-Identifier: Apache-2.0
// Divides a window between the organ and its panels. Where the organ would become too narrow,
// panels fold. And lists the folders that a viewer offers to open, with a mark on those that are
// bundles.
#include "organbake/player/panel_layout.h"

#include <algorithm>
#include <cmath>
#include <system_error>
#include <tuple>

namespace organbake {
namespace {

constexpr int kFolded = 24, kTools = 230, kReadings = 236, kTimeline = 66;

}  // namespace

double panel_scale(const Eigen::Vector2i& window_px, double screen_scale) {
  constexpr double kFullHd = 1080, kWholeSteps = 4;
  const double by_height = std::clamp(window_px.y() / kFullHd, 1.0, 2.0);
  return std::floor(kWholeSteps * std::max(by_height, screen_scale)) / kWholeSteps;
}

PanelLayout lay_out_panels(const Eigen::Vector2i& window_px, double scale, const OpenPanels& wanted,
                           bool prefer_readings) {
  const auto px = [scale](int at_scale_1) { return static_cast<int>(scale * at_scale_1); };
  PanelLayout layout;
  layout.open = wanted;
  const auto free_px = [&] {
    return window_px.x() - px(layout.open.tools ? kTools : kFolded) -
           px(layout.open.readings ? kReadings : kFolded);
  };
  bool& first = prefer_readings ? layout.open.tools : layout.open.readings;
  bool& second = prefer_readings ? layout.open.readings : layout.open.tools;
  if (free_px() < px(kLeastOrgan_px)) first = false;
  if (free_px() < px(kLeastOrgan_px)) second = false;
  const int left = px(layout.open.tools ? kTools : kFolded);
  const int right = px(layout.open.readings ? kReadings : kFolded);
  const int bottom = px(layout.open.timeline ? kTimeline : kFolded);
  const int width = std::max(1, window_px.x() - left - right);
  const int height = std::max(1, window_px.y() - bottom);
  layout.tools = {0, 0, left, height};
  layout.readings = {left + width, 0, right, height};
  layout.timeline = {0, height, window_px.x(), bottom};
  layout.organ = {left, 0, width, height};
  return layout;
}

namespace fs = std::filesystem;

std::vector<ListedFolder> list_folders(const fs::path& folder) {
  std::vector<ListedFolder> listed;
  std::error_code problem;
  for (fs::directory_iterator at(folder, fs::directory_options::skip_permission_denied, problem),
       end;
       !problem && at != end; at.increment(problem)) {
    std::error_code unreadable;
    const std::string name = at->path().filename().string();
    if (name.starts_with('.') || !at->is_directory(unreadable)) continue;
    listed.push_back({name, fs::exists(at->path() / "manifest.json", unreadable)});
  }
  std::sort(listed.begin(), listed.end(), [](const ListedFolder& a, const ListedFolder& b) {
    return std::tie(b.is_bundle, a.name) < std::tie(a.is_bundle, b.name);
  });
  return listed;
}

}  // namespace organbake
