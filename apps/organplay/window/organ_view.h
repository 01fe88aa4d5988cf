// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "organbake/player/live_session.h"
#include "window/display.h"
#include "window/overlays.h"
#include "window/run_window.h"
#include "window/window_state.h"

namespace organbake {

// Organs in the window: the mouse's meaning, the picture, and the panels round it.
class OrganView {
 public:
  // Reads the bundles. Screenshots and interactions are saved into `save_folder`.
  OrganView(const std::vector<std::filesystem::path>& bundles, std::filesystem::path save_folder,
            std::optional<TissueSolver> solver, std::optional<DrawnLight> light);

  // Lets graphics hardware draw, in the display's context, which has to outlive this: what was
  // asked for, or by itself only a real one whose first picture is the processor's. Says which it
  // is.
  void draw_with(DrawnBy drawn_by);
  // Shows the tissue as a scope's camera does, until the person chooses otherwise.
  void look_through(const ScopePicture& scope);
  void look_with_two_eyes(double distance_mm);

  // Between Display::begin_frame() and end_frame().
  void show(Display& display);
  bool unsaved() const { return session_.record_end() > saved_steps_; }

 private:
  PixelRect picture_rect() const;  // of what can be touched, in the window
  void follow_mouse();
  void follow_keys(const Display& display);
  void advance(Display& display);
  bool draw_right_eye();  // false when it is the picture of before
  Rgb8Image seen_tissue(const View& view, const Frame& frame) const;
  Rgb8Image seen(const View& view, const Frame& frame) const;
  Rgb8Image composed();
  void swipe(Rgb8Image& picture);
  void draw_overlays() const;
  void show_panels();
  void follow_asks(Display& display);
  void save_picture(const Rgb8Image& picture, const std::string& kind);
  void save_interaction();
  std::filesystem::path free_name(const std::string& stem, const std::string& ending) const;

  std::filesystem::path save_folder_;
  Player player_;
  LiveSession session_;
  TruthPictures truth_;
  WindowState state_;
  PanelLayout layout_;
  PlayedFrame last_;
  Frame rest_frame_, right_frame_;
  std::string noted_;           // of Player::drawing_note()
  bool through_scope_ = false;  // in the last picture
  bool frame_shown_ = false;    // the display has the session's frame, and nothing else
  int tick_ = 0;
  enum class Drag { none, tool, turn, shift } drag_ = Drag::none;
  std::size_t saved_steps_ = 0;
};

}  // namespace organbake
