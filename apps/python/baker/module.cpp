// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>

#include "bindings.h"
#include "python_errors.h"

PYBIND11_MODULE(organbake, m) {
#ifdef __AVX2__
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
    throw pybind11::import_error("organbake needs a processor with AVX2 and FMA");
#endif
  m.doc() =
      "Stages of organbake as functions, with arrays in and out: surface, decimate, place, "
      "capture, "
      "register, shade. Lengths are millimetres, axes LPS; cameras look along z, x right, y down, "
      "the first pixel's centre at (0.5, 0.5). What cannot be used raises ValueError; what a stage "
      "would warn of is a UserWarning. Other threads run meanwhile.";
  pybind11::register_exception_translator(&organbake::translate_error);
  organbake::bind_meshes(m);
  organbake::bind_cameras(m);
  organbake::bind_photos(m);
}
