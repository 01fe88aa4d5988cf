// SPDX-License-Identifier: GPL-3.0-or-later
#include "exchange.h"

#include <algorithm>

#include "organbake/raycast/face_queries.h"

namespace organbake {
namespace py = pybind11;
namespace {

std::vector<Face> faces_from(const py::object& argument, std::size_t vertices) {
  const std::string wanted = "an array of whole numbers of shape (m, 3)";
  const py::array any = array_from(argument, "faces", wanted);
  const char kind = any.dtype().kind();
  if ((kind != 'i' && kind != 'u') || any.ndim() != 2 || any.shape(1) != 3)
    refuse(any, "faces", wanted);
  const auto numbers =
      py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>::ensure(any);
  std::vector<Face> faces(static_cast<std::size_t>(numbers.shape(0)));
  for (std::size_t f = 0; f < faces.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const std::int64_t index = numbers.at(static_cast<py::ssize_t>(f), k);
      if (index < 0 || static_cast<std::uint64_t>(index) >= vertices)
        throw UsageError("faces[" + std::to_string(f) + "] names vertex " + std::to_string(index) +
                         " of " + std::to_string(vertices));
      faces[f][k] = static_cast<std::uint32_t>(index);
    }
  return faces;
}

}  // namespace

TriangleMesh mesh_from(const py::object& vertices, const py::object& faces) {
  TriangleMesh mesh;
  mesh.vertices = vectors_from(vertices, "vertices_mm");
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!mesh.vertices[i].allFinite())
      throw UsageError("vertices_mm[" + std::to_string(i) + "] is not finite");
  mesh.faces = faces_from(faces, mesh.vertices.size());
  if (mesh.faces.empty()) throw UsageError("faces is empty; a mesh needs one");
  for (const std::string& turned : turn_outward(mesh).sentences())
    if (PyErr_WarnEx(PyExc_UserWarning, ("faces: " + turned).c_str(), 1) != 0)
      throw py::error_already_set();
  return mesh;
}

Rgb8Image picture_from(const py::object& argument, const std::string& name) {
  const std::string wanted = "an array of uint8 of shape (h, w, 3), sRGB";
  const py::array any = array_from(argument, name, wanted);
  constexpr py::ssize_t kMostSide = 65536;
  if (any.ndim() != 3 || any.shape(2) != 3 || any.dtype().kind() != 'u' || any.itemsize() != 1 ||
      any.shape(0) < 1 || any.shape(1) < 1 || any.shape(0) > kMostSide || any.shape(1) > kMostSide)
    refuse(any, name, wanted);
  const auto bytes =
      py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>::ensure(any);
  Rgb8Image image(static_cast<int>(any.shape(1)), static_cast<int>(any.shape(0)));
  std::copy_n(bytes.data(), image.pixels.size(), image.pixels.data());
  return image;
}

Rgb8Image mask_from(const py::object& argument, const std::string& name) {
  if (argument.is_none()) return {};
  const std::string wanted = "an array of shape (h, w), not 0 where the picture counts";
  const RealNumbers numbers = real_numbers(argument, name, wanted);
  if (numbers.ndim() != 2 || numbers.size() == 0) refuse(numbers, name, wanted);
  Rgb8Image mask(static_cast<int>(numbers.shape(1)), static_cast<int>(numbers.shape(0)));
  for (std::size_t i = 0; i < mask.pixels.size(); ++i)
    mask.pixels[i] = numbers.data()[i / 3] != 0 ? 255 : 0;
  return mask;
}

Intrinsics lens_from(const py::object& argument, int width, int height) {
  const std::string wanted = "fx, fy, cx, cy, or these with k1, k2, p1, p2, k3 after them";
  const RealNumbers numbers = real_numbers(argument, "intrinsics", wanted);
  if (numbers.ndim() != 1 || (numbers.size() != 4 && numbers.size() != 9))
    refuse(numbers, "intrinsics", wanted);
  const double* n = numbers.data();
  Intrinsics lens{width, height, n[0], n[1], n[2], n[3]};
  if (numbers.size() == 9)
    lens.k1 = n[4], lens.k2 = n[5], lens.p1 = n[6], lens.p2 = n[7], lens.k3 = n[8];
  lens.check();
  return lens;
}

RowMatrix4d matrix_of(const RigidTransform& pose) {
  RowMatrix4d matrix = RowMatrix4d::Identity();
  matrix.topRows<3>() << pose.rotation, pose.translation;
  return matrix;
}

}  // namespace organbake
