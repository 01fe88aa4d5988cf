// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace organbake {

void bind_view(pybind11::module_& m);  // organplay.View

}  // namespace organbake
