// SPDX-License-Identifier: Apache-2.0
#include "organplay.h"

#include <dlfcn.h>

#include "graphics/graphics_module.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {

void* load_door(const LoadedModule& module, const char* door) {
  const std::filesystem::path file = module_folder() / module.file;
  const std::string instead = "; " + module.instead;
  if (!std::filesystem::exists(file))
    throw UsageError(module.missing + " (" + file.string() + " is missing)" + instead);
  void* const loaded = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!loaded) throw UsageError(module.failed + ": " + ::dlerror() + instead);
  void* const found = ::dlsym(loaded, door);
  if (!found) throw Error(ExitCode::internal, file.string() + " is not a module of organplay");
  return found;
}

namespace {

OpenedGraphics open_graphics() {
  const auto open = reinterpret_cast<decltype(&organplay_open_graphics)>(
      load_door({"organplay_graphics.so", "this organplay was built without graphics hardware",
                 "graphics hardware cannot be used", "draw with --draw cpu"},
                "organplay_open_graphics"));
  OpenedGraphics opened;
  open(opened);
  return opened;
}

}  // namespace

void draw_as_asked(const Command& command, Player& player, const RunContext& context) {
  if (command.drawn_by != DrawnBy::graphics) return;
  OpenedGraphics opened = open_graphics();
  player.draw_by(std::move(opened.drawing));
  context.info("drawn by " + opened.device);
}

void warn_of_processor(const Command& command, const Player& player, const RunContext& context) {
  if (command.drawn_by == DrawnBy::graphics && !player.drawing_note().empty())
    context.warn("the processor drew in the graphics hardware's place: " + player.drawing_note());
}

void open_window(const Command& command, const RunContext& context) {
  const auto run = reinterpret_cast<decltype(&organplay_run_window)>(load_door(
      {"organplay_window.so", "this organplay was built without its window",
       "the window cannot be loaded",
       "without a window, give --script with --out, --view-deg with -o, --sheet, --compare or "
       "--bench"},
      "organplay_run_window"));
  WindowCommand window = command;
  if (!command.lens.empty()) window.scope = read_scope_lens(command.lens).picture;
  window.width = command.picture_size().width;
  window.height = command.picture_size().height;
  run(window, context);
}

void run_dataset(const Command& command, const RunContext& context) {
  check_apart_from_bundles(command.frame_file, command);
  namespace fs = std::filesystem;
  using Make = void (*)(const fs::path&, const std::vector<fs::path>&, const fs::path&,
                        const RunContext&, std::string&);
  const auto make = reinterpret_cast<Make>(
      load_door({"organplay_dataset.so", "this organplay was built without data sets",
                 "data sets cannot be made", "without them, give --script with --out and --layers"},
                "organplay_make_dataset"));
  std::string told;
  make(command.dataset, command.bundles, command.frame_file, context, told);
  Results results(command.shared.json);
  results.wrote("dataset", command.frame_file);
  context.info(told);
  results.finish();
}

}  // namespace organbake
