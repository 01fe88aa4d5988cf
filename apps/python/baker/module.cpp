// SPDX-License-Identifier: GPL-3.0-or-later
// The module organbake: surfaces of volumes and their proxies, and the door to the other stages.
#include <optional>
#include <span>

#include "exchange.h"
#include "organbake/decimate/decimate.h"
#include "organbake/isosurface/isosurface.h"

namespace organbake {
namespace py = pybind11;
namespace {

// (nz, ny, nx), as SimpleITK and nibabel's transpose hand them over; x runs fastest.
Volume volume_from(const py::object& voxels, const py::object& spacing, const py::object& origin,
                   const py::object& direction) {
  const std::string wanted = "an array of real numbers of shape (nz, ny, nx)";
  const RealNumbers numbers = real_numbers(voxels, "voxels", wanted);
  if (numbers.ndim() != 3 || numbers.size() == 0) refuse(numbers, "voxels", wanted);
  Volume volume;
  for (int axis = 0; axis < 3; ++axis)
    volume.size[axis] = static_cast<int>(numbers.shape(2 - axis));
  set_values(volume, std::span(numbers.data(), static_cast<std::size_t>(numbers.size())));
  volume.spacing_mm = vector_from(spacing, "spacing_mm");
  volume.origin_mm = vector_from(origin, "origin_mm");
  if (!direction.is_none()) {
    const auto rows = vectors_from(direction, "direction");
    if (rows.size() != 3) throw UsageError("direction must be an array of shape (3, 3)");
    for (int r = 0; r < 3; ++r) volume.direction.row(r) = rows[r].transpose();
  }
  check_volume(volume, "voxels");
  return volume;
}

SurfaceCap cap_from(const py::object& cap) {
  if (py::isinstance<py::bool_>(cap)) return cap.cast<bool>() ? SurfaceCap::flat : SurfaceCap::open;
  return chosen<SurfaceCap>(
      "cap", cap.cast<std::string>(),
      {{"flat", SurfaceCap::flat}, {"round", SurfaceCap::round}, {"open", SurfaceCap::open}});
}

py::tuple surface(const py::object& voxels, const py::object& spacing, const py::object& origin,
                  const py::object& direction, std::optional<double> level,
                  std::optional<int> label, std::size_t largest, double min_size_mm, bool refine,
                  const py::object& cap, double smooth_mm, bool keep_volume) {
  Volume volume = volume_from(voxels, spacing, origin, direction);
  if (label) make_labels(volume);
  if (level && label)
    throw UsageError("level and label are both given; a CT has a level, a mask a label");
  IsosurfaceOptions options;
  options.iso_hu = level;
  options.label = label.value_or(1);
  options.largest = largest, options.min_size_mm = min_size_mm, options.refine = refine;
  options.cap = cap_from(cap), options.smooth_mm = smooth_mm, options.keep_volume = keep_volume;
  options.check();
  const Isosurface found = run_released([&](const RunContext& context) {
    return label ? extract_label_surface(volume, options, context)
                 : extract_isosurface(volume, options, context);
  });
  return py::make_tuple(rows_of(found.mesh.vertices), rows_of(found.mesh.faces));
}

void bind_surface(py::module_& m) {
  m.def("surface", &surface, py::arg("voxels"), py::arg("spacing_mm"), py::kw_only(),
        py::arg("origin_mm") = py::make_tuple(0, 0, 0), py::arg("direction") = py::none(),
        py::arg("level") = py::none(), py::arg("label") = py::none(), py::arg("largest") = 1,
        py::arg("min_size_mm") = 0.0, py::arg("refine") = false, py::arg("cap") = "flat",
        py::arg("smooth_mm") = 1.0, py::arg("keep_volume") = true,
        "The closed surface of a CT at a level (HU), or of one label of a mask. voxels: (nz, ny, "
        "nx) of any real kind; spacing_mm, origin_mm: of x, y, z; direction: (3, 3), its columns "
        "are the axes of x, y, z. level None without a label: half-way between the two commonest "
        "values. largest: how many pieces are kept, 0 for all. smooth_mm blurs a mask, and with "
        "keep_volume its surface encloses "
        "the volume of its voxels. cap: flat, round or open, where the organ leaves the volume. "
        "Returns "
        "vertices (n, 3) float64 in world mm and faces (m, 3) uint32, counter-clockwise from "
        "outside. Raises ValueError for a level outside the volume's values or an absent label.");
}

DecimateResult reduce(const py::object& vertices, const py::object& faces, std::size_t count,
                      const std::string& method, bool flips) {
  const TriangleMesh mesh = mesh_from(vertices, faces);
  DecimateOptions options;
  options.faces = count, options.flips = flips;
  using Method = DecimateMethod;
  options.method = chosen<Method>("method", method,
                                  {{"fitted", Method::fitted},
                                   {"lindstrom_turk", Method::lindstrom_turk},
                                   {"quadric", Method::quadric}});
  options.check();
  return run_released([&](const RunContext& context) { return decimate(mesh, options, context); });
}

void bind_decimate(py::module_& m) {
  using Summary = DecimateResult;
  py::class_<Summary>(m, "Proxy",
                      "A decimated surface, and how far it lies from the one it stands for.")
      .def_property_readonly(
          "vertices_mm", [](const Summary& s) { return rows_of(s.proxy.vertices); },
          "(n, 3) float64.")
      .def_property_readonly(
          "faces", [](const Summary& s) { return rows_of(s.proxy.faces); }, "(m, 3) uint32.")
      .def_readonly("rms_mm", &Summary::rms_mm, "From the surface to the proxy.")
      .def_readonly("max_mm", &Summary::max_mm, "The largest of all points.")
      .def_readonly("reverse_rms_mm", &Summary::reverse_rms_mm, "From the proxy to the surface.")
      .def_readonly("reverse_max_mm", &Summary::reverse_max_mm)
      .def_readonly("volume_change", &Summary::volume_change,
                    "Share of the surface's volume; means little for an open one.")
      .def_readonly("closed_manifold", &Summary::closed_manifold)
      .def_readonly("genus", &Summary::genus, "-1 where it is no manifold.")
      .def_readonly("self_intersecting_faces", &Summary::self_intersecting_faces);
  m.def("decimate", &reduce, py::arg("vertices_mm"), py::arg("faces"), py::kw_only(),
        py::arg("count") = 80, py::arg("method") = "fitted", py::arg("flips") = true,
        "Reduces a surface to at most `count` faces and fits them to it. Returns a Proxy. Raises "
        "ValueError for a surface that cannot be used and for a budget that cannot be reached.");
}

}  // namespace

void bind_meshes(py::module_& m) {
  bind_surface(m);
  bind_decimate(m);
}

}  // namespace organbake

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
