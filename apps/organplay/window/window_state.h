// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the window knows beside the organ, and its pages: the start, and the question at leaving.

#include <array>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "organbake/instruments/instrument.h"
#include "organbake/player/bundle_list.h"
#include "organbake/player/live_session.h"
#include "organbake/player/panel_layout.h"
#include "organbake/player/player.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/truth/truth_recorder.h"
#include "window/display.h"

namespace organbake {

// What the frame is held against.
enum class Against { nothing, truth, polygons, difference };

enum class FalseColors { none, displacement, strain };
// What shares the window with the organ that can be touched.
enum class Beside { nothing, at_rest, right_eye };

// What the person in front of the window has chosen, and asks for in this picture.
struct WindowState {
  OpenPanels panels;
  bool prefer_readings = false;  // where there is room for one side alone

  bool paused = false, step_once = false;
  int slowness = 1;  // one time step every so many pictures
  // Each with the numbers that were chosen for it, and which of them the next touch takes.
  std::array<InstrumentKind, std::variant_size_v<InstrumentKind>> kinds = instrument_kinds();
  std::size_t chosen = 0;
  DrawOptions drawing;
  ScopePicture scope;  // what a scope's camera makes of the picture, once one was given
  bool through_scope = false;
  FalseColors colors = FalseColors::none;
  double most_displacement_mm = 10, most_strain = 0.3;  // of the colours' range
  bool proxy_lines = false, tetrahedra_lines = false, camera_lines = false, manifold_lines = false;
  Beside beside = Beside::nothing;
  double eyes_mm = kUsualBaseline_mm;  // from the left eye to the right one
  Against against = Against::nothing;
  float swipe_share = 0.5f;

  double force_n = 0, largest_force_n = 0;
  std::string message;

  struct Asks {
    bool picture = false, window = false, interaction = false, full_screen = false;
  } asks;

  void toggle(Beside what) { beside = beside == what ? Beside::nothing : what; }
  // Chosen again, it pokes again. Leaves a message where the organ cannot be cut.
  void choose(std::size_t kind, const Player& player);
  void restart(LiveSession& session);  // the organ at rest, and a new record
};

// In the order of instrument_kinds().
struct ToolButton {
  char key;  // 0: none of its own
  const char* label;
};
inline constexpr std::array<ToolButton, std::variant_size_v<InstrumentKind>> kToolButtons = {
    {{0, "poke"}, {'G', "grab (G)"}, {'C', "cut (C)"}, {'X', "scissors (X)"}, {'N', "needle (N)"}}};

// What is there without a bundle: how to get one, the folders round here with the bundles among
// them, and a field for the path of one. Returns the folder to
// open, empty as long as there is none. `problem` is shown, when the last one could not be opened.
class StartPage {
 public:
  std::string show(const std::string& problem);

 private:
  std::string chosen_in_list();
  void go_to(const std::filesystem::path& folder);

  char folder_[1024] = "";
  std::filesystem::path listed_;
  std::vector<ListedFolder> list_;
};

// Escape asks whether to leave, and once more or "stay" goes back. `unsaved`: something would be
// lost.
class LeaveQuestion {
 public:
  void show(Display& display, bool unsaved);

 private:
  bool asked_ = false;
};

}  // namespace organbake
