// SPDX-License-Identifier: Apache-2.0
#include "window/run_window.h"

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "organbake/core/error.h"
#include "window/display.h"
#include "window/leave_question.h"
#include "window/organ_view.h"
#include "window/start_page.h"

namespace organbake {
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

void run_window(const WindowCommand& command, const RunContext& context) {
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

extern "C" void organplay_run_window(const organbake::WindowCommand& command,
                                     const organbake::RunContext& context) {
  organbake::run_window(command, context);
}
