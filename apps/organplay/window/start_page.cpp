// SPDX-License-Identifier: Apache-2.0
#include "window/start_page.h"

#include <imgui.h>

#include <algorithm>
#include <system_error>

namespace organbake {

void StartPage::go_to(const std::filesystem::path& folder) {
  std::error_code problem;
  const auto full = std::filesystem::absolute(folder, problem).lexically_normal();
  listed_ = problem ? folder : full;
  list_ = list_folders(listed_);
}

// The folder of a bundle that was clicked; another one's folders are listed in its place.
std::string StartPage::chosen_in_list() {
  if (listed_.empty()) go_to(".");
  std::filesystem::path next, chosen;
  ImGui::TextDisabled("%s", listed_.c_str());
  ImGui::BeginChild("folders", {0, -3 * ImGui::GetFrameHeightWithSpacing()}, true);
  if (ImGui::Selectable(".. (the folder above)")) next = listed_.parent_path();
  for (const ListedFolder& folder : list_) {
    if (ImGui::Selectable((folder.name + (folder.is_bundle ? "   bundle" : "/")).c_str()))
      (folder.is_bundle ? chosen : next) = listed_ / folder.name;
  }
  ImGui::EndChild();
  if (!next.empty()) go_to(next);
  return chosen.string();
}

std::string StartPage::show(const std::string& problem) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize();
  ImGui::SetNextWindowPos({0.5f * size.x, 0.5f * size.y}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(size.x, 48 * em), std::min(size.y, 34 * em)});
  ImGui::Begin("organplay", nullptr,
               ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize);
  ImGui::TextWrapped("No organ is open. A bundle is a folder that 'organbake bake' makes:");
  ImGui::TextDisabled("  organbake bake phantom.yaml -o phantom");
  if (!problem.empty()) {
    ImGui::PushTextWrapPos(0);
    ImGui::TextColored({1, 0.5f, 0.4f, 1}, "%s", problem.c_str());
    ImGui::PopTextWrapPos();
  }
  std::string chosen = chosen_in_list();
  ImGui::TextUnformatted("Folder of a bundle:");
  ImGui::SetNextItemWidth(-6 * em);
  if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
  const bool entered =
      ImGui::InputText("##folder", folder_, sizeof folder_, ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  const bool opened = ImGui::Button("Open");
  ImGui::End();
  if (chosen.empty() && (entered || opened)) chosen = folder_;
  return chosen;
}

}  // namespace organbake
