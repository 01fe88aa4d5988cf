// SPDX-License-Identifier: Apache-2.0
#include "window/timeline_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cstdio>

namespace organbake {
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

}  // namespace organbake
