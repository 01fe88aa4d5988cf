// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace organbake {

void bind_meshes(pybind11::module_& m);   // surface, decimate
void bind_cameras(pybind11::module_& m);  // place, capture
void bind_photos(pybind11::module_& m);   // register, shade

}  // namespace organbake
