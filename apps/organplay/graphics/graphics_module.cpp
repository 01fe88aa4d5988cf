// SPDX-License-Identifier: Apache-2.0
#include "graphics/graphics_module.h"

#include "organbake/graphics/graphics_drawing.h"

extern "C" void organplay_open_graphics(organbake::OpenedGraphics& opened) {
  opened.drawing = std::make_shared<organbake::OffscreenDrawing>();
  opened.device = organbake::current_graphics_device().name;
}
