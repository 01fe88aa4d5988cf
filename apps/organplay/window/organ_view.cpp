// SPDX-License-Identifier: Apache-2.0
#include "window/window.h"

#include <imgui.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "organbake/core/files.h"
#include "organbake/core/stopwatch.h"
#include "organbake/core/text.h"
#ifdef ORGANBAKE_GRAPHICS
#include "organbake/graphics/graphics_drawing.h"
#endif
#include "organbake/image/png.h"
#include "organbake/player/orbit.h"

namespace organbake {
namespace {

constexpr double kTimeStep_s = 1.0 / 60;
constexpr double kPushPerNotch_mm = 2;

DeformOptions deform_options(std::optional<TissueSolver> solver) {
  DeformOptions options;
  options.solver = solver;
  options.time_step_s = kTimeStep_s;
  return options;
}

Eigen::Vector2d vector_from(const ImVec2& v) { return {v.x, v.y}; }

}  // namespace

OrganView::OrganView(const std::vector<std::filesystem::path>& bundles,
                     std::filesystem::path save_folder, std::optional<TissueSolver> solver,
                     std::optional<DrawnLight> light)
    : save_folder_(std::move(save_folder)),
      player_(bundles, deform_options(solver)),
      session_(player_, kTimeStep_s),
      truth_(bundles.front(), player_.bundle().shell()) {
  state_.drawing.measure = true;
  player_.set_cut_times(Player::CutTimes{});  // a picture must not wait for a cut
  state_.drawing.light = player_.light_for(light);
}

void OrganView::draw_with(DrawnBy drawn_by) {
#ifdef ORGANBAKE_GRAPHICS
  if (drawn_by == DrawnBy::processor) return;
  try {
    const GraphicsDevice device = current_graphics_device();
    if (device.software && drawn_by == DrawnBy::automatic) return;
    player_.draw_by(std::make_shared<GraphicsDrawing>(GraphicsDrawing::FirstPicture::checked));
    state_.message = "drawn by " + device.name;
  } catch (const GraphicsError& error) {
    state_.message = std::string("drawn by the processor: ") + error.what();
  }
#else
  if (drawn_by == DrawnBy::graphics)
    state_.message = "drawn by the processor: this organplay was built without graphics hardware";
#endif
}

void OrganView::look_through(const ScopePicture& scope) {
  state_.scope = scope;
  state_.through_scope = !(scope == ScopePicture());
}

void OrganView::look_with_two_eyes(double distance_mm) {
  state_.eyes_mm = distance_mm;
  state_.beside = Beside::right_eye;
}

void OrganView::show(Display& display) {
  layout_ =
      lay_out_panels(display.size_px(), display.scale(), state_.panels, state_.prefer_readings);
  follow_mouse();
  follow_keys(display);
  advance(display);
  draw_overlays();
  show_panels();
  follow_asks(display);
}

// Beside the organ at rest the one that can be touched is the right half; of two eyes the left.
PixelRect OrganView::picture_rect() const {
  PixelRect rect = layout_.organ;
  if (state_.beside == Beside::nothing) return rect;
  rect.width = std::max(1, rect.width / 2);
  if (state_.beside == Beside::at_rest) rect.x += rect.width;
  return rect;
}

void OrganView::follow_mouse() {
  const ImGuiIO& io = ImGui::GetIO();
  const PixelRect rect = picture_rect();
  const Eigen::Vector2d pointer = vector_from(io.MousePos) - Eigen::Vector2d(rect.x, rect.y);
  const Eigen::Vector2d moved = vector_from(io.MouseDelta);
  if (drag_ == Drag::none && !io.WantCaptureMouse) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
      const InstrumentKind kind =
          io.KeyCtrl ? InstrumentKind(Grasper{}) : state_.kinds[state_.chosen];
      drag_ = io.KeyShift ? Drag::shift : session_.touch(pointer, kind) ? Drag::tool : Drag::turn;
    }
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Right)) drag_ = Drag::turn;
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Middle)) drag_ = Drag::shift;
  }
  if (drag_ == Drag::tool) session_.drag(pointer);
  if (drag_ == Drag::turn) session_.turn(moved);
  if (drag_ == Drag::shift) session_.shift(moved);
  if (!ImGui::IsAnyMouseDown()) {
    if (drag_ == Drag::tool) session_.let_go();
    drag_ = Drag::none;
  }
  if (io.MouseWheel != 0 && !io.WantCaptureMouse) {
    if (session_.holds()) {
      session_.push(kPushPerNotch_mm * io.MouseWheel);
    } else {
      session_.zoom(io.MouseWheel);
    }
  }
}

void OrganView::follow_keys(const Display& display) {
  const auto toggle = [&display](char key, bool& what) { what ^= display.pressed(key); };
  toggle(' ', state_.paused);
  toggle('1', state_.proxy_lines);
  toggle('2', state_.camera_lines);
  toggle('3', state_.manifold_lines);
  toggle('4', state_.tetrahedra_lines);
  if (display.pressed('B')) state_.toggle(Beside::at_rest);
  if (display.pressed('E')) state_.toggle(Beside::right_eye);
  if (!(state_.scope == ScopePicture())) toggle('O', state_.through_scope);
  if (display.pressed('.')) state_.paused = state_.step_once = true;
  if (display.pressed('R')) state_.restart(session_);
  if (display.pressed('F')) session_.face_front();
  if (display.pressed('Z')) session_.undo();
  if (display.pressed('Y')) session_.redo();
  for (std::size_t i = 0; i < kToolButtons.size(); ++i)
    if (kToolButtons[i].key != 0 && display.pressed(kToolButtons[i].key)) state_.choose(i, player_);
  state_.asks.picture |= display.pressed('P');
  state_.asks.window |= display.pressed('W');
  state_.asks.interaction |= display.pressed('S');
  state_.asks.full_screen |= display.pressed(Display::kF11);
}

void OrganView::advance(Display& display) {
  // Against the truth time stands still: the truth takes longer than a frame.
  const bool plain = state_.against == Against::nothing;
  const bool runs = !state_.paused && plain && ++tick_ % state_.slowness == 0;
  const PixelRect rect = picture_rect();
  const bool wall = state_.through_scope && state_.scope.surroundings;
  state_.drawing.background = wall ? DrawOptions::kCavity : DrawOptions().background;
  last_ = session_.advance(runs || state_.step_once, rect.width, rect.height, state_.drawing);
  player_.load_ahead();  // once there is something to look at
  if (runs || state_.step_once) {
    state_.force_n = 0;
    for (const Eigen::Vector3d& force : last_.step.tip_force_n) state_.force_n += force.norm();
    state_.largest_force_n = std::max(state_.largest_force_n, state_.force_n);
  }
  state_.step_once = false;
  const bool moved = draw_right_eye() || !last_.draw.unchanged;
  const bool as_drawn = plain && state_.colors == FalseColors::none &&
                        state_.beside != Beside::at_rest && through_scope_ == state_.through_scope;
  through_scope_ = state_.through_scope;
  if (!as_drawn || moved || !frame_shown_)
    display.set_picture(composed(), {layout_.organ.x, layout_.organ.y});
  frame_shown_ = as_drawn;
  display.move_picture({layout_.organ.x, layout_.organ.y});
  if (const auto why = why_empty(player_, session_.view(), last_.draw)) state_.message = *why;
  if (player_.drawing_note() != noted_) {
    noted_ = player_.drawing_note();
    if (!noted_.empty()) state_.message = "drawn by the processor: " + noted_;
  }
}

bool OrganView::draw_right_eye() {
  if (state_.beside != Beside::right_eye) return false;
  const View view = right_eye(session_.view(), state_.eyes_mm);
  Stopwatch watch;
  const DrawReport report = player_.draw(view, session_.drawn(state_.drawing), right_frame_);
  last_.draw_ms += watch.lap();
  return !report.unchanged;
}

// The lens's distortion is left out: what is touched lies under the pointer.
Rgb8Image OrganView::seen_tissue(const View& view, const Frame& frame) const {
  Rgb8Image picture = frame.color;
  if (!state_.through_scope) return picture;
  if (state_.scope.surroundings)
    paint_cavity_wall({frame, view, rest_bounds(player_)}, DrawOptions::kCavity, picture);
  apply_scope_picture(state_.scope, view.camera.intrinsics.fx, frame.depth_mm, picture);
  return picture;
}

Rgb8Image OrganView::seen(const View& view, const Frame& frame) const {
  return state_.colors == FalseColors::none ? seen_tissue(view, frame)
                                            : measured_picture(state_, player_, view, frame);
}

Rgb8Image OrganView::composed() {
  const View& view = session_.view();
  Rgb8Image picture = seen(view, session_.frame());
  if (state_.against != Against::nothing) swipe(picture);
  if (state_.beside == Beside::nothing) return picture;
  if (state_.beside == Beside::right_eye)
    return side_by_side(picture, seen(right_eye(view, state_.eyes_mm), right_frame_));
  player_.draw_at_rest(view, state_.drawing, rest_frame_);
  return side_by_side(rest_frame_.color, picture);
}

// Left of the handle the frame, right of it what it is held against.
void OrganView::swipe(Rgb8Image& shown) {
  const Rgb8Image& other = truth_.picture(state_.against, player_.proxy_positions(),
                                          session_.view(), session_.frame(), state_.drawing);
  const int x = std::clamp(int(state_.swipe_share * float(shown.width)), 0, shown.width);
  for (int y = 0; y < shown.height; ++y) {
    std::copy_n(other.at(0, y) + 3 * x, 3 * (shown.width - x), shown.at(0, y) + 3 * x);
  }
  const float at = float(layout_.organ.x + x);
  ImGui::GetBackgroundDrawList()->AddLine({at, 0}, {at, float(shown.height)},
                                          IM_COL32(255, 255, 255, 150));
}

void OrganView::draw_overlays() const {
  const PixelRect rect = picture_rect();
  const Overlay overlay(session_.view(), {rect.x, rect.y}, {rect.width, rect.height});
  const Bundle& bundle = player_.bundle();  // whose cameras and manifold lead the view
  const ViewWeights& weights = last_.draw.weights;
  for (std::size_t organ = 0; organ < player_.organ_count(); ++organ) {
    const Bundle& now = player_.bundle_now(organ);
    if (state_.proxy_lines) overlay.draw_proxy(now.proxy, player_.proxy_positions(organ));
    if (state_.tetrahedra_lines && player_.can_cut())
      overlay.draw_tetrahedra(*now.mechanics.body, player_.node_positions(organ));
  }
  if (state_.camera_lines) overlay.draw_cameras(bundle.cameras, weights);
  if (state_.manifold_lines) overlay.draw_manifold(bundle.cameras, weights);
}

void OrganView::show_panels() {
  const bool tools_first = !state_.prefer_readings;
  if (const Panel panel("Tools", layout_.tools, layout_.open.tools, state_.panels.tools);
      panel.unfolded()) {
    show_tools(state_, player_, session_);
    ImGui::Separator();
    show_look(state_, player_, session_, truth_);
  } else if (panel.bar_pressed() && !tools_first) {
    state_.prefer_readings = false;
  }
  if (const Panel panel("Readings", layout_.readings, layout_.open.readings,
                        state_.panels.readings);
      panel.unfolded()) {
    show_readings(state_, session_, last_);
  } else if (panel.bar_pressed()) {
    state_.prefer_readings = true;
  }
  if (const Panel panel("History", layout_.timeline, layout_.open.timeline, state_.panels.timeline);
      panel.unfolded())
    show_timeline(state_, session_);
}

void OrganView::follow_asks(Display& display) {
  const WindowState::Asks asks = std::exchange(state_.asks, {});
  const Rgb8Image& picture = session_.frame().color;
  const bool two = state_.beside == Beside::right_eye && right_frame_.color.width == picture.width;
  if (asks.picture)
    save_picture(two ? side_by_side(picture, right_frame_.color) : picture, "frame");
  if (asks.window)
    display.read_back([this](const Rgb8Image& picture) { save_picture(picture, "window"); });
  if (asks.interaction) save_interaction();
  if (asks.full_screen) display.toggle_full_screen();
}

std::filesystem::path OrganView::free_name(const std::string& stem,
                                           const std::string& ending) const {
  for (std::size_t i = 1;; ++i) {
    constexpr std::size_t kDigits = 3;
    const auto path = save_folder_ / (stem + "_" + padded(i, kDigits) + ending);
    if (!std::filesystem::exists(path)) return path;
  }
}

void OrganView::save_picture(const Rgb8Image& picture, const std::string& kind) {
  const auto path = free_name(kind, ".png");
  constexpr int kQuick = 1;  // PNG level: as the frames of a played script
  write_png(path, picture, kQuick);
  std::printf("%s\n", path.c_str());
  std::fflush(stdout);
  state_.message = "saved " + path.string();
}

void OrganView::save_interaction() {
  if (session_.record_end() == 0) {
    state_.message = "Nothing has been recorded yet.";
    return;
  }
  const auto path = free_name("interaction", ".json");
  write_file_atomically(path, script_to_json(session_.record(path.stem().string())));
  std::printf("%s\n", path.c_str());
  std::fflush(stdout);
  state_.message = "saved " + path.string() + "; play it with --script";
  saved_steps_ = session_.record_end();
}

}  // namespace organbake
