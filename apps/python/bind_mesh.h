// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace organbake {

// The class Mesh: what another solver needs of an organ.
void bind_mesh(pybind11::module_& m);

}  // namespace organbake
