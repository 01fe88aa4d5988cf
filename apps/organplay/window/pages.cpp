// SPDX-License-Identifier: Apache-2.0
// The window from its start page to its end.
#include "window/run_window.h"

#include <imgui.h>
#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <system_error>
#include <thread>

#include "organbake/core/error.h"
#include "window/window.h"

namespace organbake {
void WindowState::choose(std::size_t kind, const Player& player) {
  if (has_blade(kinds[kind]) && !player.can_cut()) {
    message = player.bundle().mechanics.body
                  ? "Springs cannot be cut: choose finite elements below."
                  : "Springs cannot be cut: bake the organ with tetrahedra.";
    return;
  }
  chosen = kind == chosen ? 0 : kind;
}

void WindowState::restart(LiveSession& session) {
  session.reset();
  largest_force_n = 0;
}

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

namespace {

// Pictures no faster than time goes; where the display does not wait, we do.
class Pace {
 public:
  void wait() {
    constexpr auto kPicture = std::chrono::microseconds(1'000'000 / 60);
    next_ = std::max(next_ + kPicture, std::chrono::steady_clock::now());
    std::this_thread::sleep_until(next_);
  }

 private:
  std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now();
};

}  // namespace

extern "C" void organplay_run_window(const WindowCommand& command, const RunContext& context) {
  // A bundle named on the command line that can't be read is an error like any other.
  std::unique_ptr<OrganView> named;
  const auto open = [&command](const std::vector<std::filesystem::path>& bundles) {
    auto opened =
        std::make_unique<OrganView>(bundles, command.save_folder, command.solver, command.light);
    opened->look_through(command.scope);
    if (command.eyes_mm) opened->look_with_two_eyes(*command.eyes_mm);
    return opened;
  };
  if (!command.bundles.empty()) named = open(command.bundles);
  Display display("organplay", command.width, command.height);
  std::unique_ptr<OrganView> view = std::move(named);  // ends before the display, which it draws in
  if (view) view->draw_with(command.drawn_by);
  StartPage start;
  LeaveQuestion leave;
  std::string problem;
  Pace pace;
  while (!context.cancelled() && display.begin_frame()) {
    if (display.pressed('Q')) display.ask_to_close();
    leave.show(display, view && view->unsaved());
    try {
      if (view) {
        view->show(display);
      } else if (const std::string folder = start.show(problem); !folder.empty()) {
        view = open({folder});
        view->draw_with(command.drawn_by);
      }
    } catch (const Error& error) {  // of a bundle, perhaps of a camera that came late
      view.reset();
      display.hide_picture();
      problem = error.what();
    }
    display.end_frame();
    pace.wait();
  }
}

}  // namespace organbake
