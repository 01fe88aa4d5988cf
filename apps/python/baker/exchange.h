// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/pybind11.h>

#include <mutex>
#include <string>
#include <vector>

#include "array_arguments.h"
#include "organbake/core/error.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// Meshes, pictures and lenses between NumPy and C++. What comes from Python throws UsageError,
// Python's ValueError, naming the argument, what it is and what it must be.

// (n, 3) vertices in mm, and (m, 3) faces of whole numbers.
TriangleMesh mesh_from(const pybind11::object& vertices, const pybind11::object& faces);

// (h, w, 3) of uint8.
Rgb8Image picture_from(const pybind11::object& argument, const std::string& name);
// (h, w) of any kind of number or bool: white where it is not 0; empty for None.
Rgb8Image mask_from(const pybind11::object& argument, const std::string& name);

// (fx, fy, cx, cy), or with k1, k2, p1, p2, k3 after them.
Intrinsics lens_from(const pybind11::object& argument, int width, int height);
using RowMatrix4d = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
RowMatrix4d matrix_of(const RigidTransform& pose);

// Runs work without the interpreter's lock; its warnings become Python's UserWarnings.
template <class Work>
auto run_released(const Work& work) {
  std::mutex mutex;
  std::vector<std::string> warnings;
  const RunContext context(
      [&](LogLevel level, std::string_view message) {
        const std::lock_guard lock(mutex);
        if (level == LogLevel::warning) warnings.emplace_back(message);
      },
      {}, nullptr);
  auto result = [&] {
    const pybind11::gil_scoped_release release;
    return work(context);
  }();
  for (const std::string& warning : warnings)
    if (PyErr_WarnEx(PyExc_UserWarning, warning.c_str(), 1) != 0)
      throw pybind11::error_already_set();
  return result;
}

void bind_meshes(pybind11::module_& m);   // surface, decimate
void bind_cameras(pybind11::module_& m);  // place, capture
void bind_photos(pybind11::module_& m);   // register, shade

}  // namespace organbake
