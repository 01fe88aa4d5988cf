// SPDX-License-Identifier: Apache-2.0
#include "window/organ_view.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/png.h"
#include "window/overlays.h"

namespace organbake {
namespace {

constexpr double kTimeStep_s = 1.0 / 60;
constexpr double kPushPerNotch_mm = 2;

// In the order of instrument_kinds().
struct ToolButton {
  char key;  // 0: none of its own
  const char* label;
};
constexpr std::array<ToolButton, std::variant_size_v<InstrumentKind>> kToolButtons = {
    {{0, "poke"}, {'G', "grab (G)"}, {'C', "cut (C)"}, {'X', "scissors (X)"}, {'N', "needle (N)"}}};

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
  options_.measure = true;
  if (player_.can_relight()) options_.light = light.value_or(player_.default_light());
}

void OrganView::show(Display& display) {
  follow_mouse();
  follow_keys(display);
  advance(display);
  draw_overlays();
  controls(display);
  readings();
  if (screenshot_asked_) {
    save_picture(session_.frame().color, "frame");
    screenshot_asked_ = false;
  }
}

void OrganView::follow_mouse() {
  const ImGuiIO& io = ImGui::GetIO();
  const Eigen::Vector2d pointer = vector_from(io.MousePos), moved = vector_from(io.MouseDelta);
  if (drag_ == Drag::none && !io.WantCaptureMouse) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
      const InstrumentKind kind = io.KeyCtrl ? InstrumentKind(Grasper{}) : kind_;
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

void OrganView::follow_keys(Display& display) {
  if (display.pressed(' ')) paused_ = !paused_;
  if (display.pressed('.')) paused_ = step_once_ = true;
  if (display.pressed('R')) session_.reset(), largest_force_n_ = 0;
  if (display.pressed('F')) session_.face_front();
  for (std::size_t i = 0; i < kToolButtons.size(); ++i)
    if (kToolButtons[i].key != 0 && display.pressed(kToolButtons[i].key))
      choose(instrument_kinds()[i]);
  if (display.pressed('1')) proxy_lines_ = !proxy_lines_;
  if (display.pressed('2')) camera_lines_ = !camera_lines_;
  if (display.pressed('3')) manifold_lines_ = !manifold_lines_;
  if (display.pressed('P')) screenshot_asked_ = true;
  if (display.pressed('W')) save_window(display);
  if (display.pressed('S')) save_interaction();
}

// Chosen again, it pokes again.
void OrganView::choose(const InstrumentKind& kind) {
  if (has_blade(kind) && !player_.can_cut()) {
    message_ = "springs cannot be cut: play without --solver springs, an organ with tetrahedra";
    return;
  }
  kind_ = kind_ == kind ? InstrumentKind(Ball{}) : kind;
}

void OrganView::advance(Display& display) {
  // Against the truth time stands still: the truth takes longer than a frame.
  const bool runs = !paused_ && against_ == Against::nothing && ++tick_ % slowness_ == 0;
  const Eigen::Vector2i size = display.size_px();
  last_ = session_.advance(runs || step_once_, size.x(), size.y(), options_);
  player_.load_ahead();  // once there is something to look at
  if (runs || step_once_) {
    force_n_ = 0;
    for (const Eigen::Vector3d& force : last_.step.tip_force_n) force_n_ += force.norm();
    largest_force_n_ = std::max(largest_force_n_, force_n_);
  }
  step_once_ = false;
  if (against_ == Against::nothing) {
    if (!last_.draw.unchanged || !frame_shown_) display.set_picture(session_.frame().color);
  } else {
    display.set_picture(swiped(size));
  }
  frame_shown_ = against_ == Against::nothing;
}

// Left of the handle the frame, right of it what it is held against.
Rgb8Image OrganView::swiped(const Eigen::Vector2i& size) {
  const Rgb8Image& other = truth_.picture(against_, player_.proxy_positions(), session_.view(),
                                          session_.frame(), options_);
  Rgb8Image shown = session_.frame().color;
  const int x = std::clamp(int(swipe_share_ * float(size.x())), 0, size.x());
  for (int y = 0; y < size.y(); ++y) {
    std::copy_n(other.at(0, y) + 3 * x, 3 * (size.x() - x), shown.at(0, y) + 3 * x);
  }
  ImGui::GetBackgroundDrawList()->AddLine({float(x), 0}, {float(x), float(size.y())},
                                          IM_COL32(255, 255, 255, 150));
  return shown;
}

void OrganView::draw_overlays() const {
  const Bundle& bundle = player_.bundle();  // whose cameras and manifold lead the view
  const View& view = session_.view();
  const ViewWeights& weights = last_.draw.weights;
  for (std::size_t organ = 0; proxy_lines_ && organ < player_.organ_count(); ++organ)
    draw_proxy(player_.bundle_now(organ).proxy, player_.proxy_positions(organ), view);
  if (camera_lines_) draw_cameras(bundle.cameras, weights, view);
  if (manifold_lines_) draw_manifold(bundle.cameras, weights, view);
}

void OrganView::controls(Display& display) {
  ImGui::SetNextWindowPos({12, 12}, ImGuiCond_FirstUseEver);
  ImGui::Begin("organplay", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::TextDisabled(
      "drag the tissue: poke, grab (also with Ctrl), cut, snip or pierce; wheel: deeper");
  ImGui::TextDisabled("drag beside it or right: turn; middle: move; wheel: zoom");
  ImGui::Separator();
  for (std::size_t i = 0; i < kToolButtons.size(); ++i) {
    const InstrumentKind& kind = instrument_kinds()[i];
    if (ImGui::RadioButton(kToolButtons[i].label, kind_ == kind)) choose(kind);
    ImGui::SameLine();
  }
  float radius = float(session_.tool_radius_mm());
  ImGui::SetNextItemWidth(110);
  if (ImGui::SliderFloat("tool radius, mm", &radius, 1, 20, "%.1f")) {
    session_.set_tool_radius_mm(radius);
  }
  if (std::holds_alternative<Blade>(kind_)) {
    float width = float(session_.cut_width_mm());
    ImGui::SetNextItemWidth(110);
    if (ImGui::SliderFloat("taken away, mm", &width, 0, 4, "%.1f"))
      session_.set_cut_width_mm(width);
  }
  ImGui::Checkbox("pause (space)", &paused_);
  ImGui::SameLine();
  if (ImGui::Button("step (.)")) paused_ = step_once_ = true;
  ImGui::SameLine();
  ImGui::SetNextItemWidth(90);
  ImGui::SliderInt("times slower", &slowness_, 1, 20);
  ImGui::Checkbox("proxy (1)", &proxy_lines_);
  ImGui::SameLine();
  ImGui::Checkbox("cameras (2)", &camera_lines_);
  ImGui::SameLine();
  ImGui::Checkbox("VPM (3)", &manifold_lines_);
  if (player_.can_relight()) {
    int light = static_cast<int>(options_.light);
    ImGui::SetNextItemWidth(90);
    ImGui::Combo("light", &light, "baked\0world\0scope\0");
    options_.light = static_cast<DrawnLight>(light);
  }
  if (player_.is_cut()) {
    ImGui::TextDisabled("the truth knows the organ as it was baked, without cuts");
  } else if (truth_.available() && player_.organ_count() == 1) {
    int against = static_cast<int>(against_);
    ImGui::Combo("beside it", &against, "nothing\0truth\0polygons\0difference to truth × 4\0");
    against_ = static_cast<Against>(against);
    if (against_ != Against::nothing) ImGui::SliderFloat("swipe", &swipe_share_, 0, 1, "");
  } else {
    ImGui::TextDisabled("no truth in this bundle (bundle.surface: true bakes it)");
  }
  if (ImGui::Button("front (F)")) session_.face_front();
  ImGui::SameLine();
  if (ImGui::Button("reset (R)")) session_.reset(), largest_force_n_ = 0;
  ImGui::SameLine();
  if (ImGui::Button("picture (P)")) screenshot_asked_ = true;
  ImGui::SameLine();
  if (ImGui::Button("window (W)")) save_window(display);
  ImGui::SameLine();
  if (ImGui::Button("interaction (S)")) save_interaction();
  if (!message_.empty()) ImGui::TextUnformatted(message_.c_str());
  ImGui::End();
}

void OrganView::readings() const {
  const ImGuiIO& io = ImGui::GetIO();
  // Beside the controls, or in a narrow window in the corner that they leave free.
  constexpr float kBothWide = 960;
  const bool beside = io.DisplaySize.x >= kBothWide;
  ImGui::SetNextWindowPos({io.DisplaySize.x - 12, beside ? 12 : io.DisplaySize.y - 12},
                          ImGuiCond_Always, {1, beside ? 0.0f : 1.0f});
  ImGui::SetNextWindowBgAlpha(0.6f);
  ImGui::Begin("readings", nullptr,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoTitleBar |
                   ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoFocusOnAppearing);
  ImGui::Text("force     %7.2f N  (most %.2f)", force_n_, largest_force_n_);
  ImGui::Text("depth     %7.1f mm", session_.depth_mm());
  ImGui::Text("contacts  %7zu", last_.step.contacts);
  if (last_.step.tissue_contacts > 0) ImGui::Text("of tissue %7zu", last_.step.tissue_contacts);
  if (last_.step.tool_contacts > 0) ImGui::Text("of tools  %7zu", last_.step.tool_contacts);
  if (last_.step.recovered) ImGui::Text("the tissue's state was lost and reset");
  ImGui::Separator();
  ImGui::Text("deform    %7.2f ms", last_.deform_ms);
  ImGui::Text("draw      %7.2f ms%s", last_.draw_ms, last_.draw.unchanged ? "  unchanged" : "");
  const DrawTimes& t = last_.draw.times;
  ImGui::TextDisabled("place %.2f  splat %.2f  base %.2f", t.transform, t.splat, t.base);
  ImGui::TextDisabled("blend %.2f  fill %.2f  tools %.2f", t.resolve, t.fill, t.tools);
  ImGui::Text("window    %7.0f pictures/s", io.Framerate);
  ImGui::Separator();
  const ViewWeights& w = last_.draw.weights;
  for (int i = 0; i < 3; ++i) {
    if (w.weights[i] > 0) ImGui::Text("camera %-3u %6.1f %%", w.cameras[i], 100 * w.weights[i]);
  }
  ImGui::Text("samples   %7zu drawn", last_.draw.samples_drawn);
  ImGui::TextDisabled("skipped: %zu facing away, %zu outside", last_.draw.samples_facing_away,
                      last_.draw.samples_outside_view);
  ImGui::Text("holes     %7zu filled, %zu left", last_.draw.holes_before, last_.draw.holes_after);
  ImGui::Text("stretch   %7.1f px per texel", last_.draw.largest_stretch_px);
  ImGui::End();
}

std::filesystem::path OrganView::free_name(const std::string& stem,
                                           const std::string& ending) const {
  for (std::size_t i = 1;; ++i) {
    constexpr std::size_t kDigits = 3;
    const auto path = save_folder_ / (stem + "_" + padded(i, kDigits) + ending);
    if (!std::filesystem::exists(path)) return path;
  }
}

void OrganView::save_window(Display& display) {
  display.read_back([this](const Rgb8Image& picture) { save_picture(picture, "window"); });
}

void OrganView::save_picture(const Rgb8Image& picture, const std::string& kind) {
  const auto path = free_name(kind, ".png");
  constexpr int kQuick = 1;  // PNG level: as the frames of a played script
  write_png(path, picture, kQuick);
  std::printf("%s\n", path.c_str());
  std::fflush(stdout);
  message_ = "saved " + path.string();
}

void OrganView::save_interaction() {
  const auto path = free_name("interaction", ".json");
  write_file_atomically(path, script_to_json(session_.record(path.stem().string())));
  std::printf("%s\n", path.c_str());
  std::fflush(stdout);
  message_ = "saved " + path.string() + "; play it with --script";
}

}  // namespace organbake
