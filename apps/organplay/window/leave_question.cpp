// SPDX-License-Identifier: Apache-2.0
#include "window/leave_question.h"

#include <imgui.h>

namespace organbake {

void LeaveQuestion::show(Display& display, bool unsaved) {
  if (display.pressed(Display::kEscape)) asked_ = !asked_;
  if (!asked_) return;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5f * size.x, 0.5f * size.y}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowFocus();
  ImGui::Begin(
      "leave", nullptr,
      ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::TextUnformatted(unsaved ? "Leave organplay? What was done is not saved."
                                 : "Leave organplay?");
  if (ImGui::Button("leave (Enter)") || display.pressed(Display::kEnter)) display.ask_to_close();
  ImGui::SameLine();
  if (ImGui::Button("stay (Escape)")) asked_ = false;
  ImGui::End();
}

}  // namespace organbake
