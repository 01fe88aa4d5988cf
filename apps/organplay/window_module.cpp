// SPDX-License-Identifier: Apache-2.0
#include "window_module.h"

#include "loaded_module.h"
#include "organbake/truth/lens_picture.h"
#include "window/run_window.h"

namespace organbake {

void open_window(const Command& command, const RunContext& context) {
  using Run = void (*)(const WindowCommand&, const RunContext&);
  const auto run = reinterpret_cast<Run>(load_door(
      {"organplay_window.so", "its window", "the window cannot be loaded",
       "without a window, give --script with --out, --view-deg with -o, --sheet, --compare or "
       "--bench"},
      "organplay_run_window"));
  WindowCommand window;
  window.bundles = command.bundles;
  window.solver = command.solver;
  window.light = command.light;
  window.drawn_by = command.drawn_by;
  window.eyes_mm = command.eyes_mm;
  if (!command.lens.empty()) window.scope = read_scope_lens(command.lens).picture;
  window.width = command.picture_size().width;
  window.height = command.picture_size().height;
  run(window, context);
}

}  // namespace organbake
