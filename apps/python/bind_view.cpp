// SPDX-License-Identifier: Apache-2.0
#include "bind_view.h"

#include <pybind11/numpy.h>

#include "array_arguments.h"
#include "organbake/core/error.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/warp/view.h"

namespace organbake {
namespace py = pybind11;
namespace {

View view_from(int width, int height, double fx, double fy, const py::object& cx,
               const py::object& cy, const py::object& camera_from_world, double near_mm) {
  View view;
  Intrinsics& k = view.camera.intrinsics;
  k.width = width, k.height = height, k.fx = fx, k.fy = fy;
  k.cx = cx.is_none() ? 0.5 * width : numbers_from(cx, "cx", 1).front();
  k.cy = cy.is_none() ? 0.5 * height : numbers_from(cy, "cy", 1).front();
  const auto pose = pose_matrix_from(camera_from_world, "camera_from_world");
  if (!pose.allFinite()) throw UsageError("camera_from_world is not finite");
  const auto rotation = written_rotation(pose.leftCols<3>());
  if (!rotation)
    throw UsageError("camera_from_world holds no proper rotation (RᵀR must be I and det R = +1)");
  view.camera.camera_from_world = {*rotation, pose.col(3)};
  view.near_mm = near_mm;
  view.check();
  return view;
}

}  // namespace

void bind_view(py::module_& m) {
  py::class_<View>(m, "View",
                   "A pinhole camera and its pose: x right, y down, z forward, the first pixel's "
                   "centre at (0.5, 0.5); px and world mm (LPS).")
      .def(py::init(&view_from), py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"),
           py::arg("cx") = py::none(), py::arg("cy") = py::none(), py::kw_only(),
           py::arg("camera_from_world"), py::arg("near_mm") = 1.0,
           "camera_from_world: (3, 4) or (4, 4). cx, cy: the picture's middle unless given. Raises "
           "ValueError for what is no camera.")
      .def_static(
          "look_at",
          [](const py::object& eye, const py::object& target, const py::object& up, int width,
             int height, double fx) {
            const Eigen::Vector3d from = vector_from(eye, "eye_mm"),
                                  to = vector_from(target, "target_mm"),
                                  above = vector_from(up, "up");
            if (!from.allFinite() || !to.allFinite() || !above.allFinite() ||
                !((to - from).norm() > 0) || !(above.norm() > 0))
              throw UsageError(
                  "a view needs an eye and a target that are finite and apart, and an up "
                  "direction");
            View view;
            view.camera.intrinsics = {width, height, fx, fx, 0.5 * width, 0.5 * height};
            view.camera.camera_from_world = organbake::look_at(from, to, above.normalized());
            view.check();
            return view;
          },
          py::arg("eye_mm"), py::arg("target_mm"), py::arg("up") = py::make_tuple(0, 0, 1),
          py::kw_only(), py::arg("width") = 640, py::arg("height") = 480, py::arg("fx") = 600.0,
          "From a place towards another, both (3,), world mm, with `up` upwards in the picture.")
      .def_property_readonly("width", [](const View& v) { return v.camera.intrinsics.width; })
      .def_property_readonly("height", [](const View& v) { return v.camera.intrinsics.height; })
      .def_property_readonly(
          "intrinsics",
          [](const View& v) {
            const Intrinsics& k = v.camera.intrinsics;
            return py::make_tuple(k.fx, k.fy, k.cx, k.cy);
          },
          "fx, fy, cx, cy, px.")
      .def_property_readonly(
          "camera_from_world",
          [](const View& v) {
            py::array_t<double> pose({3, 4});
            auto at = pose.mutable_unchecked<2>();
            for (int r = 0; r < 3; ++r) {
              for (int c = 0; c < 3; ++c) at(r, c) = v.camera.camera_from_world.rotation(r, c);
              at(r, 3) = v.camera.camera_from_world.translation[r];
            }
            return pose;
          },
          "(3, 4), mm.");
}

}  // namespace organbake
