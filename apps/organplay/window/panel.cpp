// SPDX-License-Identifier: Apache-2.0
#include "window/panel.h"

#include <imgui.h>

#include <string>

namespace organbake {

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
