// SPDX-License-Identifier: Apache-2.0
#include "window/tools_panel.h"

#include <imgui.h>

#include <algorithm>

namespace organbake {
namespace {

void show_size(const InstrumentKind& kind, LiveSession& session) {
  ImGui::SetNextItemWidth(-1);
  if (std::holds_alternative<Blade>(kind)) {
    float width = float(session.cut_width_mm());
    if (ImGui::SliderFloat("##width", &width, 0, 4, "takes away %.1f mm"))
      session.set_cut_width_mm(width);
    return;
  }
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
    ImGui::TextDisabled("springs");
    return;
  }
  int solver = player.solver() == TissueSolver::fem;
  ImGui::SetNextItemWidth(-1);
  if (!ImGui::Combo("##solver", &solver, "springs\0finite elements\0")) return;
  const bool forgets = solver == 0 && has_blade(state.kind);
  if (forgets) state.kind = Ball{};
  session.set_solver(solver == 1 ? TissueSolver::fem : TissueSolver::springs);
}

}  // namespace

void show_tools(WindowState& state, const Player& player, LiveSession& session) {
  for (std::size_t i = 0; i < kToolButtons.size(); ++i) {
    const InstrumentKind& kind = instrument_kinds()[i];
    if (ImGui::RadioButton(kToolButtons[i].label, state.kind == kind)) state.choose(kind, player);
    if (i % 2 == 0) ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
  }
  ImGui::NewLine();
  show_size(state.kind, session);
  show_solver(state, player, session);
  ImGui::Checkbox("pause (space)", &state.paused);
  ImGui::SameLine();
  if (ImGui::Button("step (.)")) state.paused = state.step_once = true;
  ImGui::SetNextItemWidth(-1);
  ImGui::SliderInt("##slowness", &state.slowness, 1, 20, "%d times slower");
}

}  // namespace organbake
