// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "exchange.h"
#include "organbake/capture/capture.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {
namespace py = pybind11;
namespace {

using Cameras = std::vector<PosedCamera>;

py::array_t<double> intrinsics_of(const Cameras& cameras) {
  std::vector<std::array<double, 4>> rows;
  for (const auto& [name, k, pose] : cameras) rows.push_back({k.fx, k.fy, k.cx, k.cy});
  return rows_of(std::move(rows));
}

py::array_t<double> poses_of(const Cameras& cameras) {
  std::vector<RowMatrix4d> poses;
  for (const PosedCamera& camera : cameras) poses.push_back(matrix_of(camera.camera_from_world));
  return array_of<double>(std::move(poses), {py::ssize_t(cameras.size()), 4, 4});
}

Placement place(const py::object& vertices, const py::object& faces, int count, int map_size,
                double field_of_view_rad, double margin, const py::object& cone_axis,
                double cone_half_angle_rad) {
  const TriangleMesh mesh = mesh_from(vertices, faces);
  PlacementOptions options;
  options.count = count, options.map_size = map_size;
  options.field_of_view_rad = field_of_view_rad, options.margin = margin;
  if (!cone_axis.is_none())
    options.cone = ViewingCone{vector_from(cone_axis, "cone_axis"), cone_half_angle_rad};
  options.check();
  return run_released(
      [&](const RunContext& context) { return place_cameras(mesh, options, context); });
}

void bind_place(py::module_& m) {
  py::class_<Placement>(m, "Cameras", "Virtual cameras round an organ, all of one size.")
      .def("__len__", [](const Placement& p) { return p.cameras.size(); })
      .def_property_readonly(
          "size", [](const Placement& p) { return p.cameras.front().intrinsics.width; },
          "Pixels of a side of their square maps.")
      .def_property_readonly(
          "intrinsics", [](const Placement& p) { return intrinsics_of(p.cameras); },
          "(n, 4): fx, fy, cx, cy, px.")
      .def_property_readonly(
          "camera_from_world", [](const Placement& p) { return poses_of(p.cameras); },
          "(n, 4, 4), mm.")
      .def_property_readonly(
          "triangles", [](const Placement& p) { return rows_of(p.manifold.triangles); },
          "(t, 3) uint32: the viewing projection manifold, by cameras.");
  m.def("place", &place, py::arg("vertices_mm"), py::arg("faces"), py::kw_only(),
        py::arg("count") = 8, py::arg("map_size") = 512, py::arg("field_of_view_rad") = 0.6,
        py::arg("margin") = 0.03, py::arg("cone_axis") = py::none(),
        py::arg("cone_half_angle_rad") = 0.5,
        "Evenly spread cameras that each hold the whole organ; all round, or in a cone about an "
        "axis (from the organ to the eye). Returns Cameras.");
}

CaptureResult bake_maps(const py::object& vertices, const py::object& faces,
                        const py::object& colors, const py::object& proxy_vertices,
                        const py::object& proxy_faces, const Placement& cameras,
                        int rays_per_texel_side, double base_step_mm) {
  TriangleMesh surface = mesh_from(vertices, faces);
  const TriangleMesh proxy = mesh_from(proxy_vertices, proxy_faces);
  if (!colors.is_none()) {
    for (const Eigen::Vector3d& color : vectors_from(colors, "colors"))
      surface.colors.push_back(color.cast<float>());
    if (surface.colors.size() != surface.vertices.size())
      throw UsageError("colors holds " + std::to_string(surface.colors.size()) + " for " +
                       std::to_string(surface.vertices.size()) + " vertices");
    for (const Eigen::Vector3f& color : surface.colors)
      if (!(color.minCoeff() >= 0 && color.maxCoeff() <= 1))
        throw UsageError("colors must lie in 0…1: scene-linear RGB");
  }
  CaptureOptions options;
  options.rays_per_texel_side = rays_per_texel_side, options.base_step_mm = base_step_mm;
  options.check();
  return run_released([&](const RunContext& context) {
    const auto color =
        surface.colors.empty() ? make_material_color({}) : make_vertex_color(surface);
    return capture(surface, proxy, cameras.cameras, *color, options, context);
  });
}

std::vector<py::ssize_t> shape_of(const CameraMaps& maps) { return {maps.height, maps.width}; }

void bind_capture(py::module_& m) {
  py::class_<CameraMaps>(m, "Maps", "What one virtual camera baked; (h, w), top row first.")
      .def_property_readonly(
          "depth_mm", [](const CameraMaps& c) { return array_of<float>(c.depth_mm, shape_of(c)); },
          "float32: planar z, +inf where there is nothing.")
      .def_property_readonly(
          "color",
          [](const CameraMaps& c) {
            return array_of<float>(c.color, {c.height, c.width, 3});
          },
          "(h, w, 3) float32, scene-linear.")
      .def_property_readonly(
          "height_mm",
          [](const CameraMaps& c) { return array_of<float>(c.height_mm, shape_of(c)); },
          "float32: the microstructure over the proxy's face.")
      .def_property_readonly(
          "face", [](const CameraMaps& c) { return array_of<std::uint32_t>(c.face, shape_of(c)); },
          "uint32: of the proxy; 4294967295 at the background.")
      .def_property_readonly(
          "confidence",
          [](const CameraMaps& c) { return array_of<float>(c.confidence, shape_of(c)); },
          "float32, 0 to 1.");
  m.def(
      "capture",
      [](const py::object& vertices, const py::object& faces, const py::object& proxy_vertices,
         const py::object& proxy_faces, const Placement& cameras, const py::object& colors,
         int rays, double base_step_mm) {
        return bake_maps(vertices, faces, colors, proxy_vertices, proxy_faces, cameras, rays,
                         base_step_mm)
            .maps;
      },
      py::arg("vertices_mm"), py::arg("faces"), py::arg("proxy_vertices_mm"),
      py::arg("proxy_faces"), py::arg("cameras"), py::kw_only(), py::arg("colors") = py::none(),
      py::arg("rays_per_texel_side") = 0, py::arg("base_step_mm") = 1.5,
      "Bakes the surface over its proxy for each camera of Cameras. colors: (n, 3) scene-linear, "
      "of the vertices; None: plain tissue. Returns a list of Maps.");
}

}  // namespace

void bind_cameras(py::module_& m) {
  bind_place(m);
  bind_capture(m);
}

}  // namespace organbake
