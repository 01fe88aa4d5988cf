// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "shared_player.h"

namespace organbake {

// organplay.Step, and the player's method that returns one.
void bind_step(pybind11::module_& m,
               pybind11::class_<SharedPlayer, std::shared_ptr<SharedPlayer>>& player);

}  // namespace organbake
