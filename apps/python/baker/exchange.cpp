// SPDX-License-Identifier: GPL-3.0-or-later
#include "exchange.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "array_arguments.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/raycast/winding.h"

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

py::array array_from(const py::object& argument, const std::string& name,
                     const std::string& wanted) {
  py::array array = py::array::ensure(argument);
  if (array) return array;
  PyErr_Clear();
  throw UsageError(name + " is no array; it must be " + wanted);
}

void refuse(const py::array& array, const std::string& name, const std::string& wanted) {
  throw UsageError(name + " is " + std::string(py::str(array.dtype())) + " of the shape " +
                   std::string(py::str(array.attr("shape"))) + "; it must be " + wanted);
}

bool holds_real_numbers(const py::array& array) {
  return std::string("biuf").find(array.dtype().kind()) != std::string::npos;
}

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

py::array_t<double> vertices_of(const TriangleMesh& mesh) {
  py::array_t<double> array({py::ssize_t(mesh.vertices.size()), py::ssize_t(3)});
  double* to = array.mutable_data();
  for (const Eigen::Vector3d& v : mesh.vertices) to = std::copy_n(v.data(), 3, to);
  return array;
}

py::array_t<std::uint32_t> faces_of(const TriangleMesh& mesh) {
  py::array_t<std::uint32_t> array({py::ssize_t(mesh.faces.size()), py::ssize_t(3)});
  std::uint32_t* to = array.mutable_data();
  for (const Face& face : mesh.faces) to = std::copy(face.begin(), face.end(), to);
  return array;
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
  const py::array any = array_from(argument, name, wanted);
  if (any.ndim() != 2 || any.size() == 0 || !holds_real_numbers(any)) refuse(any, name, wanted);
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(any);
  Rgb8Image mask(static_cast<int>(any.shape(1)), static_cast<int>(any.shape(0)));
  for (std::size_t i = 0; i < mask.pixels.size(); ++i)
    mask.pixels[i] = numbers.data()[i / 3] != 0 ? 255 : 0;
  return mask;
}

Intrinsics lens_from(const py::object& argument, int width, int height) {
  const std::string wanted = "fx, fy, cx, cy, or these with k1, k2, p1, p2, k3 after them";
  const py::array any = array_from(argument, "intrinsics", wanted);
  if (any.ndim() != 1 || (any.shape(0) != 4 && any.shape(0) != 9))
    refuse(any, "intrinsics", wanted);
  const std::vector<double> n =
      numbers_from(argument, "intrinsics", static_cast<std::size_t>(any.shape(0)));
  Intrinsics lens{width, height, n[0], n[1], n[2], n[3]};
  if (n.size() == 9) lens.k1 = n[4], lens.k2 = n[5], lens.p1 = n[6], lens.p2 = n[7], lens.k3 = n[8];
  lens.check();
  return lens;
}

RigidTransform pose_from(const py::object& argument, const std::string& name) {
  const auto matrix = pose_matrix_from(argument, name);
  if (!matrix.allFinite()) throw UsageError(name + " is not finite");
  const auto rotation = written_rotation(matrix.leftCols<3>());
  if (!rotation)
    throw UsageError(name + " holds no proper rotation (RᵀR must be I and det R = +1)");
  return {*rotation, matrix.col(3)};
}

py::array_t<double> matrix_of(const RigidTransform& pose) {
  py::array_t<double> array({4, 4});
  auto at = array.mutable_unchecked<2>();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      at(r, c) = r == 3 ? (c == 3 ? 1.0 : 0.0) : c == 3 ? pose.translation[r] : pose.rotation(r, c);
  return array;
}

}  // namespace organbake
