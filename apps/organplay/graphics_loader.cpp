// SPDX-License-Identifier: Apache-2.0
#include "graphics_loader.h"

#include "graphics/graphics_module.h"
#include "loaded_module.h"

namespace organbake {
namespace {

OpenedGraphics open_graphics() {
  const auto open = reinterpret_cast<decltype(&organplay_open_graphics)>(
      load_door({"organplay_graphics.so", "graphics hardware", "graphics hardware cannot be used",
                 "draw with --draw cpu"},
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

}  // namespace organbake
