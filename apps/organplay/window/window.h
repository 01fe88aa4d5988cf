// SPDX-License-Identifier: Apache-2.0
#pragma once

// The window: its display, what it knows beside the organ, its pages (the start, and the question
// at leaving), what is drawn over the organ's picture or in its place, its panels, one for each
// subject, and the organs in it.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/image/channel_image.h"
#include "organbake/instruments/instrument.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/live_session.h"
#include "organbake/player/panel_layout.h"
#include "organbake/player/player.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/truth/truth_recorder.h"
#include "organbake/warp/view.h"
#include "window/run_window.h"

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

// Pictures of the bundle's true surface for the view and the deformation of a frame. They take a
// second or so, and are kept until either changes.
class TruthPictures {
 public:
  // Nothing can be shown when the bundle carries no surface; that is no error.
  TruthPictures(const std::filesystem::path& bundle_folder, ShellSurface shell);

  bool available() const { return available_; }
  // truth: the carried surface. polygons: the same picture painted flat onto the faces of
  // the shell's surface.
  // difference: |frame − truth| times four.
  const Rgb8Image& picture(Against against, const std::vector<Eigen::Vector3d>& positions,
                           const View& view, const Frame& frame, const DrawOptions& options);

 private:
  const CarriedSurface& surface();
  std::vector<Eigen::Vector3d> flattened(const std::vector<Eigen::Vector3d>& positions);

  std::filesystem::path bundle_folder_;
  ShellSurface shell_;
  bool available_;
  std::unique_ptr<CarriedSurface> surface_;  // read when it is first asked for
  Against kept_against_ = Against::nothing;
  View kept_view_;
  std::vector<Eigen::Vector3d> kept_positions_;
  Rgb8Image kept_;
};

// A frame of the player's organs as they are now, in the colours that were chosen (not none).
Rgb8Image measured_picture(const WindowState& state, const Player& player, const View& view,
                           const Frame& frame);

// Lines of the world over the picture, drawn into ImGui's background, where the picture lies.
class Overlay {
 public:
  Overlay(const View& view, const Eigen::Vector2i& corner_px, const Eigen::Vector2i& size_px);
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  void draw_proxy(const TriangleMesh& proxy, const std::vector<Eigen::Vector3d>& positions) const;
  void draw_tetrahedra(const TetrahedralBody& body,
                       const std::vector<Eigen::Vector3d>& nodes_mm) const;
  // The virtual cameras as pyramids; those in use are bright, as bright as they count.
  void draw_cameras(const CameraSet& cameras, const ViewWeights& active) const;
  // The VPM: the triangles of cameras, drawn between the cameras themselves.
  void draw_manifold(const CameraSet& cameras, const ViewWeights& active) const;

 private:
  void draw_line(Eigen::Vector3d a, Eigen::Vector3d b, std::uint32_t color) const;

  View view_;
  Eigen::Vector2d corner_px_;
};

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
