// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "shared_player.h"

namespace organbake {

// States that another solver computes: Player's methods for them, and the class Pictures.
void bind_states(pybind11::module_& m,
                 pybind11::class_<SharedPlayer, std::shared_ptr<SharedPlayer>>& player);

}  // namespace organbake
