// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/player/panel_layout.h"

namespace organbake {

// One of the window's panels, as wide and high as it is told, with a bar to fold it to its edge.
//
//   if (const Panel panel("tools", rect, open, wanted); panel.unfolded()) ImGui::Text("…");
class Panel {
 public:
  // open: whether there is room for it; `wanted` follows the bar.
  Panel(const char* name, const PixelRect& rect, bool open, bool& wanted);
  ~Panel();
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;

  bool unfolded() const { return open_; }
  bool bar_pressed() const { return bar_pressed_; }

 private:
  bool open_, bar_pressed_;
};

}  // namespace organbake
