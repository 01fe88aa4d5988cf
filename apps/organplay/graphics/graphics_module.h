// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "organbake/warp/organ_source.h"

namespace organbake {

struct OpenedGraphics {
  std::shared_ptr<OrganDrawing> drawing;
  std::string device;  // that draws
};

}  // namespace organbake

// The door of the module: the program loads OpenGL only when it is asked to draw with it.
extern "C" __attribute__((visibility("default"))) void organplay_open_graphics(
    organbake::OpenedGraphics& opened);
