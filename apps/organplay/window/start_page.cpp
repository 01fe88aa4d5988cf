// SPDX-License-Identifier: Apache-2.0
#include "window/start_page.h"

#include <imgui.h>

namespace organbake {

std::string StartPage::show(const std::string& problem) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5f * size.x, 0.4f * size.y}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::Begin(
      "organplay", nullptr,
      ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove);
  ImGui::TextUnformatted("No organ is open.");
  ImGui::Spacing();
  ImGui::TextUnformatted("A bundle is a folder that 'organbake bake' makes, for example:");
  ImGui::TextDisabled("  organbake bake phantom.yaml -o phantom");
  ImGui::TextDisabled("  organplay phantom");
  ImGui::Spacing();
  ImGui::TextUnformatted("Folder of a bundle:");
  ImGui::SetNextItemWidth(420);
  if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
  const bool entered =
      ImGui::InputText("##folder", folder_, sizeof folder_, ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  const bool opened = ImGui::Button("Open");
  if (!problem.empty()) {
    ImGui::Spacing();
    ImGui::PushTextWrapPos(520);
    ImGui::TextColored({1, 0.5f, 0.4f, 1}, "%s", problem.c_str());
    ImGui::PopTextWrapPos();
  }
  ImGui::End();
  return (entered || opened) && folder_[0] ? folder_ : "";
}

}  // namespace organbake
