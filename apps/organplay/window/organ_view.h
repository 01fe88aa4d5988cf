// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "organbake/player/live_session.h"
#include "window/display.h"
#include "window/truth_pictures.h"

namespace organbake {

// One bundle in the window: the mouse's meaning, the picture, the panels.
class OrganView {
 public:
  // Reads the bundle. Screenshots and interactions are saved into `save_folder`.
  OrganView(const std::vector<std::filesystem::path>& bundles, std::filesystem::path save_folder,
            std::optional<TissueSolver> solver, std::optional<DrawnLight> light);

  // Between Display::begin_frame() and end_frame().
  void show(Display& display);

 private:
  void follow_mouse();
  void follow_keys(Display& display);
  void choose(const InstrumentKind& kind);
  void advance(Display& display);
  Rgb8Image swiped(const Eigen::Vector2i& size);
  void draw_overlays() const;
  void controls(Display& display);
  void readings() const;
  void save_window(Display& display);
  void save_picture(const Rgb8Image& picture, const std::string& kind);
  void save_interaction();
  std::filesystem::path free_name(const std::string& stem, const std::string& ending) const;

  std::filesystem::path save_folder_;
  Player player_;
  LiveSession session_;
  TruthPictures truth_;
  PlayedFrame last_;
  bool frame_shown_ = false;  // the display has the session's frame, and nothing else
  DrawOptions options_;
  std::string message_;

  bool paused_ = false, step_once_ = false;
  int slowness_ = 1, tick_ = 0;   // one time step every so many pictures
  InstrumentKind kind_ = Ball{};  // of the next touch
  enum class Drag { none, tool, turn, shift } drag_ = Drag::none;
  bool proxy_lines_ = false, camera_lines_ = false, manifold_lines_ = false;
  Against against_ = Against::nothing;
  float swipe_share_ = 0.5f;
  bool screenshot_asked_ = false;
  double force_n_ = 0, largest_force_n_ = 0;
};

}  // namespace organbake
