// SPDX-License-Identifier: Apache-2.0
#include "graphics_loader.h"

#include <dlfcn.h>

#include <filesystem>

#include "graphics/graphics_module.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

OpenedGraphics open_graphics() {
  const std::filesystem::path file =
      (program_folder() / ".." / "lib" / "organbake" / "organplay_graphics.so").lexically_normal();
  constexpr const char* kWithout = "; draw with --draw cpu";
  if (!std::filesystem::exists(file))
    throw UsageError("this organplay was built without graphics hardware (" + file.string() +
                     " is missing)" + kWithout);
  // Never closed, as the window's module.
  void* const module = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!module)
    throw UsageError(std::string("graphics hardware cannot be used: ") + ::dlerror() + kWithout);
  using Open = void (*)(OpenedGraphics&);
  const auto open = reinterpret_cast<Open>(::dlsym(module, "organplay_open_graphics"));
  if (!open) throw Error(ExitCode::internal, file.string() + " is not a module of organplay");
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

}  // namespace organbake
