// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>

#include "organbake/image/channel_image.h"

namespace organbake {

// A window with Dear ImGui in it and one picture behind everything.
class Display {
 public:
  // Throws UsageError where no window can be opened.
  Display(const std::string& title, int width, int height);
  ~Display();

  // False when the user closed the window.
  bool begin_frame();
  void end_frame();
  void ask_to_close();
  // Whether a key (a letter, a digit, ' ', '.', or one of those below) went down since the last
  // frame, and no text field wanted it. However short it was: ImGui itself loses what is down for
  // less than a frame.
  bool pressed(char key) const;
  static constexpr char kEscape = 27, kEnter = 13, kF11 = 11;

  Eigen::Vector2i size_px() const;  // never empty
  double scale() const;             // of letters and panels: panel_scale()
  void toggle_full_screen();
  // Behind all panels, from a corner on; one set between the frames shows in the next.
  void set_picture(const Rgb8Image& picture, const Eigen::Vector2i& corner_px);
  void move_picture(const Eigen::Vector2i& corner_px);
  void hide_picture();
  // Hands over what the window shows at the end of this frame, panels and all.
  void read_back(std::function<void(const Rgb8Image&)> take);

 private:
  Rgb8Image drawn_window() const;
  void fit_letters();

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
