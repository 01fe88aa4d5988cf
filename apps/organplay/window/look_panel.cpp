// SPDX-License-Identifier: Apache-2.0
#include "window/look_panel.h"

#include <imgui.h>

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
  int light = static_cast<int>(state.drawing.light);
  ImGui::SetNextItemWidth(-1);
  ImGui::Combo("##light", &light, "light as baked\0light of the room\0light at the scope\0");
  state.drawing.light = static_cast<DrawnLight>(light);
}

void show_colors(WindowState& state) {
  int colors = static_cast<int>(state.colors);
  ImGui::SetNextItemWidth(-1);
  ImGui::Combo("##colours", &colors, "colours of tissue\0displacement\0strain of the skin\0");
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
  ImGui::Checkbox("wire (1)", &state.proxy_lines);
  if (player.can_cut()) {
    ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
    ImGui::Checkbox("cells (4)", &state.tetrahedra_lines);
  }
  ImGui::Checkbox("cameras (2)", &state.camera_lines);
  ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
  ImGui::Checkbox("VPM (3)", &state.manifold_lines);
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
  ImGui::Combo("##against", &against, "no truth\0truth\0polygons\0difference to truth x 4\0");
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

}  // namespace organbake
