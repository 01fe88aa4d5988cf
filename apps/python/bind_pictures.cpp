// SPDX-License-Identifier: Apache-2.0
// Python's View, Picture and Mesh: arrays over memory of theirs that keep them alive, so that
// nothing is copied.
#include <pybind11/eigen.h>

#include <array>
#include <vector>

#include "array_arguments.h"
#include "organbake/player/embedded_player.h"
#include "organbake/warp/view.h"
#include "player_bindings.h"

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
  view.camera.camera_from_world = pose_from(camera_from_world, "camera_from_world");
  view.near_mm = near_mm;
  view.check();
  return view;
}

}  // namespace

LayerSet layer_set_from(const py::object& argument) {
  std::string names;
  if (py::isinstance<py::str>(argument)) {
    names = py::cast<std::string>(argument);
  } else if (py::isinstance<py::list>(argument) || py::isinstance<py::tuple>(argument)) {
    for (const py::handle& name : argument) {
      if (!py::isinstance<py::str>(name))
        throw UsageError("layers holds " + std::string(py::repr(name)) + ", no name of a layer");
      names += (names.empty() ? "" : ",") + py::cast<std::string>(name);
    }
  } else {
    throw py::type_error("layers is " + std::string(py::repr(argument)) +
                         "; it must be names, as \"depth,mask\" or [\"depth\", \"mask\"]");
  }
  return names.empty() ? LayerSet() : layers_from(names);
}

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
            Eigen::Matrix<double, 3, 4, Eigen::RowMajor> pose;
            pose << v.camera.camera_from_world.rotation, v.camera.camera_from_world.translation;
            return pose;
          },
          "(3, 4), mm.");
}

namespace {

using PictureClass = py::class_<DrawnPicture>;

py::ssize_t height_of(const DrawnPicture& p) {
  return p.truth.height > 0 ? p.truth.height : p.color.height;
}
py::ssize_t width_of(const DrawnPicture& p) {
  return p.truth.width > 0 ? p.truth.width : p.color.width;
}

// A plane of `of` numbers a pixel over the picture's memory, which keeps the picture alive; 0: one
// number, no third axis. first(picture): where the plane begins, nullptr where it was not asked
// for.
template <class Number, class First>
void def_plane(PictureClass& picture, const char* name, int of, First first, const char* doc) {
  picture.def_property_readonly(
      name,
      [of, first](const py::object& self) -> py::object {
        const auto& p = py::cast<const DrawnPicture&>(self);
        const void* const numbers = first(p);
        if (!numbers) return py::none();
        std::vector<py::ssize_t> shape{height_of(p), width_of(p)};
        if (of > 0) shape.push_back(of);
        return py::array_t<Number>(shape, static_cast<const Number*>(numbers), self);
      },
      doc);
}

py::object skin(const py::object& self) {
  const auto& p = py::cast<const DrawnPicture&>(self);
  if (!p.layers.id) return py::none();
  return py::array_t<BoundPixel>({height_of(p), width_of(p)}, p.truth.bound.data(), self);
}

py::object weight(const py::object& self) {
  const auto& p = py::cast<const DrawnPicture&>(self);
  if (!p.layers.weight) return py::none();
  constexpr auto kStride = static_cast<py::ssize_t>(sizeof(BoundPixel));
  return py::array(py::dtype::of<float>(), {height_of(p), width_of(p)},
                   {kStride * width_of(p), kStride}, &p.truth.bound.data()->weight, self);
}

void def_flow(PictureClass& picture) {
  using Picture = const DrawnPicture&;
  def_plane<float>(
      picture, "flow_back", 2,
      [](Picture p) { return p.has_flow ? p.backward.px.data() : nullptr; },
      "(h, w, 2) float32: from here to the picture drawn before, px.");
  def_plane<bool>(
      picture, "flow_back_seen", 0,
      [](Picture p) { return p.has_flow ? p.backward.seen.data() : nullptr; },
      "(h, w) bool: whether that picture shows the point as well.");
  def_plane<float>(
      picture, "flow_from_last", 2,
      [](Picture p) { return p.has_flow ? p.forward.px.data() : nullptr; },
      "(h, w, 2) float32: of the pixels of the picture drawn before, to here, px.");
  def_plane<bool>(
      picture, "flow_from_last_seen", 0,
      [](Picture p) { return p.has_flow ? p.forward.seen.data() : nullptr; },
      "(h, w) bool: whether this picture shows their points as well.");
}

}  // namespace

void bind_picture(py::module_& m) {
  using Picture = const DrawnPicture&;
  PYBIND11_NUMPY_DTYPE(BoundPixel, face, b1, b2, height_mm);
  PictureClass picture(
      m, "Picture",
      "A drawn picture and the layers that were asked for; the others are None. All are arrays "
      "over the picture's own memory, top row first, and keep it alive.");
  picture.def_property_readonly(
      "rgb",
      [](const py::object& self) -> py::object {
        const auto& p = py::cast<Picture>(self);
        if (!p.drawn_into.is_none()) return p.drawn_into;
        return py::array_t<std::uint8_t>({height_of(p), width_of(p), py::ssize_t{3}},
                                         p.color.pixels.data(), self);
      },
      "(h, w, 3) uint8, sRGB.");
  def_plane<std::uint8_t>(
      picture, "right_rgb", 3,
      [](Picture p) { return p.right.pixels.empty() ? nullptr : p.right.pixels.data(); },
      "(h, w, 3) uint8, sRGB: what the second eye sees.");
  def_plane<float>(
      picture, "depth_mm", 0,
      [](Picture p) { return p.layers.depth ? p.truth.depth_mm.data() : nullptr; },
      "(h, w) float32: planar z, +inf at the background.");
  def_plane<float>(
      picture, "normals", 3,
      [](Picture p) { return p.layers.normals ? p.truth.normal.data() : nullptr; },
      "(h, w, 3) float32, camera axes, unit, towards the eye; 0 at the background.");
  def_plane<std::uint8_t>(
      picture, "mask", 0, [](Picture p) { return p.layers.mask ? p.truth.label.data() : nullptr; },
      "(h, w) uint8: 0 background, 1 + organ, 101 + instrument.");
  def_plane<std::uint8_t>(
      picture, "organ", 0,
      [](Picture p) {
        return p.layers.id && !p.truth.organ.empty() ? p.truth.organ.data() : nullptr;
      },
      "(h, w) uint8: whose skin; None with one organ.");
  picture
      .def_property_readonly("skin", &skin,
                             "(h, w) of face (4294967295: no skin), b1, b2, height_mm: the skin "
                             "point, below tools, too.")
      .def_property_readonly("weight", &weight,
                             "(h, w) float32: of the baked samples behind the colour, 0 to 1.");
  def_flow(picture);
}

namespace {

using Mesh = EmbeddedPlayer::Mesh;

// An array over a list of the mesh, which it keeps alive.
template <class Number>
py::array array_over(const py::object& mesh, const std::vector<Number>& list) {
  return py::array_t<Number>(static_cast<py::ssize_t>(list.size()), list.data(), mesh);
}
template <class Number, std::size_t Columns>
py::array array_over(const py::object& mesh, const std::vector<std::array<Number, Columns>>& list) {
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(list.size()),
                                       static_cast<py::ssize_t>(Columns)};
  return py::array_t<Number>(shape, reinterpret_cast<const Number*>(list.data()), mesh);
}

using MeshClass = py::class_<Mesh>;

template <class List>
void def_list(MeshClass& mesh, const char* name, List Mesh::*member, const char* doc) {
  mesh.def_property_readonly(
      name,
      [member](const py::object& self) {
        return array_over(self, py::cast<const Mesh&>(self).*member);
      },
      doc);
}

void def_proxy(MeshClass& mesh) {
  def_list(mesh, "vertices_mm", &Mesh::vertices_mm, "(n, 3): the proxy's vertices at rest.");
  def_list(mesh, "faces", &Mesh::faces,
           "(m, 3) uint32: its faces, counter-clockwise from outside.");
  def_list(mesh, "vertex_mass_kg", &Mesh::vertex_mass_kg, "(n,).");
  def_list(mesh, "vertex_anchors", &Mesh::vertex_anchors, "uint32: vertices that do not move.");
  def_list(mesh, "spring_ends", &Mesh::spring_ends, "(s, 2) uint32: vertices.");
  def_list(mesh, "spring_length_mm", &Mesh::spring_length_mm, "(s,): at rest.");
  def_list(mesh, "spring_stiffness_n_per_mm", &Mesh::spring_stiffness_n_per_mm, "(s,).");
  def_list(mesh, "spring_damping_n_s_per_mm", &Mesh::spring_damping_n_s_per_mm, "(s,).");
}

void def_solid(MeshClass& mesh) {
  def_list(mesh, "nodes_mm", &Mesh::nodes_mm,
           "(k, 3): the nodes of the tetrahedra at rest; none of an organ that was baked with "
           "mechanics.fem=false.");
  def_list(mesh, "tetrahedra", &Mesh::tetrahedra, "(t, 4) uint32: nodes, of positive volume.");
  def_list(mesh, "fill", &Mesh::fill,
           "(t,): the share of each that is tissue, of its stiffness and mass.");
  def_list(mesh, "node_mass_kg", &Mesh::node_mass_kg, "(k,).");
  def_list(mesh, "node_anchors", &Mesh::node_anchors, "uint32: nodes that do not move.");
  def_list(mesh, "vertex_tetrahedron", &Mesh::vertex_tetrahedron,
           "(n,) uint32: in which each vertex of the proxy lies.");
  def_list(
      mesh, "vertex_weights", &Mesh::vertex_weights,
      "(n, 4): of its nodes; vertices = (weights[:, :, None] * nodes[tetrahedra[in]]).sum(1).");
  def_list(mesh, "patch_first", &Mesh::patch_first,
           "(n + 1,) uint32: where the nodes begin whose motion each vertex follows; none: those "
           "of its tetrahedron.");
  def_list(mesh, "patch_nodes", &Mesh::patch_nodes, "uint32: nodes under the skin about a vertex.");
  def_list(mesh, "patch_weights", &Mesh::patch_weights, "Of each; a vertex's have the sum 1.");
}

void def_skin(MeshClass& mesh) {
  def_list(mesh, "skin_first", &Mesh::skin_first,
           "(q + 1,) uint32: where each skin node's carriers begin; none: the skin is the proxy.");
  def_list(mesh, "skin_carriers", &Mesh::skin_carriers, "uint32: vertices of the proxy.");
  def_list(mesh, "skin_weights", &Mesh::skin_weights, "Of each carrier; a node's have the sum 1.");
  def_list(mesh, "skin_faces", &Mesh::skin_faces, "(r, 3) uint32: of skin nodes.");
}

}  // namespace

void bind_mesh(py::module_& m) {
  MeshClass mesh(
      m, "Mesh",
      "What another solver needs of an organ, all at rest: its proxy with masses and "
      "springs, its tetrahedra, how the one hangs in the other and the skin on the proxy.");
  def_proxy(mesh);
  def_solid(mesh);
  def_skin(mesh);
  mesh.def_readonly("young_modulus_kpa", &Mesh::young_modulus_kpa, "Of the tissue.")
      .def_readonly("density_kg_per_m3", &Mesh::density_kg_per_m3, "Of the tissue.")
      .def_readonly("thickness_mm", &Mesh::thickness_mm, "Of the shell that the springs are.")
      .def_readonly("volume_stiffness", &Mesh::volume_stiffness, "Of the springs: 1 keeps it.")
      .def_readonly("poisson_ratio", &Mesh::poisson_ratio, "Of the tetrahedra.")
      .def_readonly("damping_s", &Mesh::damping_s, "Of the tetrahedra, by Kelvin and Voigt.");
}

}  // namespace organbake
