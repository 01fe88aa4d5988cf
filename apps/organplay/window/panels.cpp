// SPDX-License-Identifier: Apache-2.0
// The panels beside the organ: its look, readings, the time line and the tools.
#include "window/window.h"

#include <imgui.h>
#include <algorithm>
#include <cstdio>
#include <utility>

namespace organbake {
namespace {

void show_scope(WindowState& state, const Player& player, LiveSession& session) {
  const auto distance_mm = session.scope_distance_mm();
  float distance = float(distance_mm.value_or(0));
  ImGui::BeginDisabled(!distance_mm);
  ImGui::SetNextItemWidth(-1);
  if (ImGui::SliderFloat("##distance", &distance, float(LiveSession::kNearestScope_mm), 300,
                         distance_mm ? "scope at %.0f mm" : "no skin ahead",
                         ImGuiSliderFlags_Logarithmic))
    session.set_scope_distance_mm(distance);
  ImGui::EndDisabled();
  float angle = float(session.view_angle_deg());
  ImGui::SetNextItemWidth(-1);
  if (ImGui::SliderFloat("##lens", &angle, 10, 110, "lens %.0f degrees"))
    session.set_view_angle_deg(angle);
  if (!(state.scope == ScopePicture()))
    ImGui::Checkbox("scope's picture (O)", &state.through_scope);
  if (!player.can_relight()) return;
  std::string titles;  // each with a zero behind it, as ImGui wants them
  for (const LightNames& light : kLightNames) (titles += "light ").append(light.title) += '\0';
  int light = static_cast<int>(*state.drawing.light);
  ImGui::SetNextItemWidth(-1);
  ImGui::Combo("##light", &light, titles.c_str());
  state.drawing.light = static_cast<DrawnLight>(light);
}

void show_colors(WindowState& state) {
  int colors = static_cast<int>(state.colors);
  ImGui::SetNextItemWidth(-1);
  ImGui::Combo("##colours", &colors,
               "colours of tissue\0how far it has moved\0how much it is stretched\0");
  state.colors = static_cast<FalseColors>(colors);
  if (state.colors == FalseColors::none) return;
  const bool strain = state.colors == FalseColors::strain;
  float most = float(strain ? 100 * state.most_strain : state.most_displacement_mm);
  ImGui::SetNextItemWidth(-1);
  ImGui::SliderFloat("##most", &most, 1, 100, strain ? "up to %.0f %%" : "up to %.0f mm",
                     ImGuiSliderFlags_Logarithmic);
  (strain ? state.most_strain : state.most_displacement_mm) = strain ? most / 100 : most;
}

void show_lines(WindowState& state, const Player& player) {
  ImGui::TextDisabled("lines of:");
  ImGui::Checkbox("surface (1)", &state.proxy_lines);
  if (player.can_cut()) {
    ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
    ImGui::Checkbox("inside (4)", &state.tetrahedra_lines);
  }
  ImGui::Checkbox("cameras (2)", &state.camera_lines);
  ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
  ImGui::Checkbox("between (3)", &state.manifold_lines);
}

void show_beside(WindowState& state, const Player& player, const TruthPictures& truth) {
  for (const auto& [label, what] : {std::pair{"at rest beside it (B)", Beside::at_rest},
                                    std::pair{"two eyes (E)", Beside::right_eye}}) {
    bool shown = state.beside == what;
    if (ImGui::Checkbox(label, &shown)) state.toggle(what);
  }
  if (!truth.available() || player.organ_count() > 1) return;
  if (player.is_cut() || state.beside != Beside::nothing) {
    state.against = Against::nothing;
    return;
  }
  int against = static_cast<int>(state.against);
  ImGui::SetNextItemWidth(-1);
  ImGui::Combo("##against", &against,
               "as it is drawn\0its true surface\0flat triangles\0difference x 4\0");
  state.against = static_cast<Against>(against);
  if (state.against == Against::nothing) return;
  ImGui::SetNextItemWidth(-1);
  ImGui::SliderFloat("##swipe", &state.swipe_share, 0, 1, "swipe");
}

}  // namespace

void show_look(WindowState& state, const Player& player, LiveSession& session,
               const TruthPictures& truth) {
  show_scope(state, player, session);
  show_colors(state);
  show_lines(state, player);
  show_beside(state, player, truth);
  if (ImGui::Button("front (F)")) session.face_front();
  ImGui::SameLine();
  if (ImGui::Button("full screen (F11)")) state.asks.full_screen = true;
}

namespace {

// A line of the readings: a name, and what is read beside it.
template <class... Values>
void reading(const char* name, const char* format, const Values&... values) {
  constexpr float kNameShare = 0.48f;
  ImGui::TextUnformatted(name);
  ImGui::SameLine(kNameShare * ImGui::GetWindowWidth());
  ImGui::Text(format, values...);
}

void show_contact(const WindowState& state, const LiveSession& session, const StepReport& step) {
  reading("force", "%.2f N", state.force_n);
  reading("at most", "%.2f N", state.largest_force_n);
  reading("depth", "%.1f mm", session.depth_mm());
  if (step.recovered) ImGui::TextWrapped("The tissue's state was lost and reset.");
}

void show_touching(const StepReport& step) {
  reading("tool touches at", "%zu points", step.contacts);
  if (step.tissue_contacts > 0) reading("tissue on tissue", "%zu points", step.tissue_contacts);
  if (step.tool_contacts > 0) reading("tools on tools", "%zu", step.tool_contacts);
}

void show_times(const PlayedFrame& last) {
  reading("moving tissue", "%.2f ms", last.deform_ms);
  reading("drawing", "%.2f ms%s", last.draw_ms, last.draw.unchanged ? ", unchanged" : "");
  const DrawTimes& t = last.draw.times;
  for (const auto& [name, ms] :
       {std::pair("  placing points", t.transform), std::pair("  drawing points", t.splat),
        std::pair("  coarse skin below", t.base), std::pair("  blending cameras", t.resolve),
        std::pair("  closing holes", t.fill), std::pair("  tools", t.tools)})
    reading(name, "%.2f ms", ms);
}

void show_drawing(const DrawReport& draw) {
  const ViewWeights& w = draw.weights;
  for (int i = 0; i < 3; ++i)
    if (w.weights[i] > 0) reading("from camera", "%u: %.0f %%", w.cameras[i], 100 * w.weights[i]);
  reading("points drawn", "%zu", draw.samples_drawn);
  reading("pixels filled", "%zu", draw.filled_pixels);
}

}  // namespace

void show_readings(const WindowState& state, const LiveSession& session, const PlayedFrame& last) {
  show_contact(state, session, last.step);
  reading("pictures", "%.0f a second", ImGui::GetIO().Framerate);
  if (!ImGui::CollapsingHeader("Details")) return;
  show_touching(last.step);
  ImGui::Separator();
  show_times(last);
  ImGui::Separator();
  show_drawing(last.draw);
}

namespace {

bool button(const char* label, bool enabled) {
  ImGui::BeginDisabled(!enabled);
  const bool pressed = ImGui::Button(label);
  ImGui::EndDisabled();
  ImGui::SameLine();
  return pressed;
}

// Beside what the window has to say.
void show_line(const std::string& message, LiveSession& session) {
  constexpr double kStepsPerSecond = 60;
  const int last = static_cast<int>(session.recorded_steps());
  int position = static_cast<int>(std::min(session.position(), session.recorded_steps()));
  char label[80];
  std::snprintf(label, sizeof label, "%.1f of %.1f s%s", position / kStepsPerSecond,
                last / kStepsPerSecond, session.seeking() ? " ..." : "");
  constexpr float kLineShare = 0.45f;
  ImGui::SetNextItemWidth(message.empty() ? -1 : kLineShare * ImGui::GetWindowWidth());
  if (ImGui::SliderInt("##time", &position, 0, last, label, ImGuiSliderFlags_AlwaysClamp))
    session.seek(static_cast<std::size_t>(position));
  if (message.empty()) return;
  ImGui::SameLine();
  ImGui::TextUnformatted(message.c_str());
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", message.c_str());
}

}  // namespace

void show_timeline(WindowState& state, LiveSession& session) {
  if (button("undo (Z)", session.can_undo())) session.undo();
  if (button("redo (Y)", session.can_redo())) session.redo();
  if (session.records() ? button("stop recording", true) : button("record anew", true))
    session.records() ? session.stop_recording() : state.restart(session);
  if (session.replaying() ? button("stop", true) : button("replay", session.record_end() > 0))
    session.replaying() ? session.stop_replay() : session.replay();
  if (button("rest (R)", true)) state.restart(session);
  if (button("save (S)", session.record_end() > 0)) state.asks.interaction = true;
  if (button("picture (P)", true)) state.asks.picture = true;
  if (button("window (W)", true)) state.asks.window = true;
  ImGui::NewLine();
  show_line(state.message, session);
}

namespace {

// The numbers of the kind's own, and of a blunt one its radius.
void show_size(InstrumentKind& kind, LiveSession& session) {
  each_number_of(kind, [](const InstrumentNumber& number, double& value) {
    float shown = float(value);
    ImGui::SetNextItemWidth(-1);
    if (ImGui::SliderFloat((std::string("##") + number.name).c_str(), &shown, float(number.least),
                           float(number.usual), number.title))
      value = shown;
  });
  if (!Instrument{.kind = kind}.is_blunt()) return;
  ImGui::SetNextItemWidth(-1);
  float radius = float(session.tool_radius_mm());
  if (ImGui::SliderFloat("##radius", &radius, 1, 20, "radius %.1f mm"))
    session.set_tool_radius_mm(radius);
}

bool all_have_tetrahedra(const Player& player) {
  for (std::size_t o = 0; o < player.organ_count(); ++o)
    if (!player.bundle(o).mechanics.body) return false;
  return true;
}

void show_solver(WindowState& state, const Player& player, LiveSession& session) {
  if (!all_have_tetrahedra(player)) {
    ImGui::TextDisabled("springs: cannot be cut");
    return;
  }
  int solver = player.solver() == TissueSolver::fem;
  ImGui::SetNextItemWidth(-1);
  if (!ImGui::Combo("##solver", &solver, "springs: quick\0finite elements: cut\0")) return;
  if (solver == 0 && has_blade(state.kinds[state.chosen])) state.chosen = 0;
  session.set_solver(solver == 1 ? TissueSolver::fem : TissueSolver::springs);
}

}  // namespace

void show_tools(WindowState& state, const Player& player, LiveSession& session) {
  for (std::size_t i = 0; i < kToolButtons.size(); ++i) {
    if (ImGui::RadioButton(kToolButtons[i].label, state.chosen == i)) state.choose(i, player);
    if (i % 2 == 0) ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
  }
  ImGui::NewLine();
  show_size(state.kinds[state.chosen], session);
  show_solver(state, player, session);
  ImGui::Checkbox("pause (space)", &state.paused);
  ImGui::SameLine();
  if (ImGui::Button("step (.)")) state.paused = state.step_once = true;
  ImGui::SetNextItemWidth(-1);
  ImGui::SliderInt("##slowness", &state.slowness, 1, 20, "%d times slower");
}

Panel::Panel(const char* name, const PixelRect& rect, bool open, bool& wanted) : open_(open) {
  ImGui::SetNextWindowPos({float(rect.x), float(rect.y)});
  ImGui::SetNextWindowSize({float(rect.width), float(rect.height)});
  ImGui::Begin(name, nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoScrollWithMouse);
  const bool lies = rect.width > rect.height;
  ImGui::PushID("fold");
  const float thick = ImGui::GetFrameHeight();
  const ImVec2 bar =
      lies    ? ImVec2(thick, ImGui::GetContentRegionAvail().y)
      : open_ ? ImVec2(ImGui::GetContentRegionAvail().x, thick)
              : ImVec2(ImGui::GetContentRegionAvail().x, ImGui::GetContentRegionAvail().y);
  // A letter says which it is where a word finds no room.
  const std::string label = open_ && !lies ? std::string(name) : std::string(1, name[0]);
  bar_pressed_ = ImGui::Button(label.c_str(), bar);
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip("%s the panel: %s", open_ ? "fold" : "unfold", name);
  ImGui::PopID();
  if (bar_pressed_) wanted = !open_;
  if (lies) ImGui::SameLine();
  if (open_) ImGui::BeginChild("content");
}

Panel::~Panel() {
  if (open_) ImGui::EndChild();
  ImGui::End();
}

}  // namespace organbake
