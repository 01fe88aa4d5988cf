// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <mutex>
#include <string>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// Meshes, pictures and lenses between NumPy and C++. What comes from Python throws UsageError,
// Python's ValueError, naming the argument, what it is and what it must be.

pybind11::array array_from(const pybind11::object& argument, const std::string& name,
                           const std::string& wanted);
[[noreturn]] void refuse(const pybind11::array& array, const std::string& name,
                         const std::string& wanted);
bool holds_real_numbers(const pybind11::array& array);  // or bools

// (n, 3) vertices in mm, and (m, 3) faces of whole numbers.
TriangleMesh mesh_from(const pybind11::object& vertices, const pybind11::object& faces);
pybind11::array_t<double> vertices_of(const TriangleMesh& mesh);
pybind11::array_t<std::uint32_t> faces_of(const TriangleMesh& mesh);

// (h, w, 3) of uint8.
Rgb8Image picture_from(const pybind11::object& argument, const std::string& name);
// (h, w) or (h, w, 3) of any kind of number or bool: white where it is not 0; empty for None.
Rgb8Image mask_from(const pybind11::object& argument, const std::string& name);

// (fx, fy, cx, cy), or with k1, k2, p1, p2, k3 after them.
Intrinsics lens_from(const pybind11::object& argument, int width, int height);
RigidTransform pose_from(const pybind11::object& argument, const std::string& name);
pybind11::array_t<double> matrix_of(const RigidTransform& pose);  // 4 × 4

// A plane over its own memory.
template <class Value>
pybind11::array_t<Value> plane_of(std::vector<Value> values, std::vector<pybind11::ssize_t> shape) {
  auto* const kept = new std::vector<Value>(std::move(values));
  const pybind11::capsule owner(kept, [](void* p) { delete static_cast<std::vector<Value>*>(p); });
  return pybind11::array_t<Value>(std::move(shape), kept->data(), owner);
}

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
