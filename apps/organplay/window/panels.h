// SPDX-License-Identifier: Apache-2.0
#pragma once

// The window's panels, one for each subject.

#include "organbake/player/panel_layout.h"
#include "window/window_state.h"

namespace organbake {

// How the organ is looked at: scope, lens and light, colours and lines over it, what stands beside.
void show_look(WindowState& state, const Player& player, LiveSession& session,
               const TruthPictures& truth);

// Forces, depths and contacts, how long step and picture took, and what they were made of.
void show_readings(const WindowState& state, const LiveSession& session, const PlayedFrame& last);

// What was done: undone and redone, recorded, replayed, saved, and a line of its time to go along.
void show_timeline(WindowState& state, LiveSession& session);

// The tool of the next touch, and what stands for the tissue.
void show_tools(WindowState& state, const Player& player, LiveSession& session);

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
