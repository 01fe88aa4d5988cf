// SPDX-License-Identifier: Apache-2.0
#include "window/readings_panel.h"

#include <imgui.h>

namespace organbake {
namespace {

void show_contact(const WindowState& state, const LiveSession& session, const StepReport& step) {
  ImGui::Text("force     %7.2f N", state.force_n);
  ImGui::Text("at most   %7.2f N", state.largest_force_n);
  ImGui::Text("depth     %7.1f mm", session.depth_mm());
  ImGui::Text("contacts  %7zu", step.contacts);
  if (step.tissue_contacts > 0) ImGui::Text("of tissue %7zu", step.tissue_contacts);
  if (step.tool_contacts > 0) ImGui::Text("of tools  %7zu", step.tool_contacts);
  if (step.recovered) ImGui::TextWrapped("The tissue's state was lost and reset.");
}

void show_times(const PlayedFrame& last) {
  ImGui::Text("deform    %7.2f ms", last.deform_ms);
  ImGui::Text("draw      %7.2f ms%s", last.draw_ms, last.draw.unchanged ? "  unchanged" : "");
  const DrawTimes& t = last.draw.times;
  ImGui::TextDisabled("place %.2f  splat %.2f\nbase %.2f  blend %.2f\nfill %.2f  tools %.2f",
                      t.transform, t.splat, t.base, t.resolve, t.fill, t.tools);
  ImGui::Text("window    %7.0f pictures/s", ImGui::GetIO().Framerate);
}

void show_drawing(const DrawReport& draw) {
  const ViewWeights& w = draw.weights;
  for (int i = 0; i < 3; ++i) {
    if (w.weights[i] > 0) ImGui::Text("camera %-3u %6.1f %%", w.cameras[i], 100 * w.weights[i]);
  }
  ImGui::Text("samples   %7zu drawn", draw.samples_drawn);
  ImGui::TextDisabled("skipped: %zu facing away,\n%zu outside", draw.samples_facing_away,
                      draw.samples_outside_view);
  ImGui::Text("holes     %7zu filled\n          %7zu left", draw.holes_before, draw.holes_after);
  ImGui::Text("stretch   %7.1f px per texel", draw.largest_stretch_px);
}

}  // namespace

void show_readings(const WindowState& state, const LiveSession& session, const PlayedFrame& last) {
  show_contact(state, session, last.step);
  ImGui::Separator();
  show_times(last);
  ImGui::Separator();
  show_drawing(last.draw);
}

}  // namespace organbake
