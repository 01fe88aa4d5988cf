// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/deform/deformer.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/warp/draw_options.h"

namespace organbake {

// What makes the pictures. By itself graphics hardware makes those of a window that has it, and the
// processor all others.
enum class DrawnBy { automatic, processor, graphics };

struct WindowCommand {
  std::vector<std::filesystem::path> bundles;  // none: the start page
  std::filesystem::path save_folder = ".";
  std::optional<TissueSolver> solver = {};  // nothing: what the organs have
  DrawnBy drawn_by = DrawnBy::automatic;
  std::optional<DrawnLight> light;  // to begin with; else what the organ is meant for
  std::optional<double> eyes_mm;    // from the left eye to the right one, both shown to begin with
  ScopePicture scope = {};          // what a scope's camera makes of the picture
  int width = 1280, height = 720;
};

// Opens the window and stays until it is closed or the context is cancelled. The door of the
// module: the program loads OpenGL only then. Throws UsageError where there is no display,
// NoInputError or BadDataError for the bundle.
extern "C" __attribute__((visibility("default"))) void organplay_run_window(
    const WindowCommand& command, const RunContext& context);

}  // namespace organbake
