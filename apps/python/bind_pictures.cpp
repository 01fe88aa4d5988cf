// SPDX-License-Identifier: Apache-2.0
// Python's View, Picture and Mesh: arrays over memory that C++ owns and that they keep alive, so
// that nothing is copied.
#include <pybind11/numpy.h>

#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "array_arguments.h"
#include "organbake/core/error.h"
#include "organbake/geometry/rigid_transform.h"
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

namespace {

using Owner = std::shared_ptr<DrawnPicture>;

// Keeps the picture as long as the array lives.
py::capsule keeper(const Owner& owner) {
  return py::capsule(new Owner(owner), [](void* kept) { delete static_cast<Owner*>(kept); });
}

// A plane of `of` numbers a pixel over the picture's memory; none: one number, no third axis.
template <class Number>
py::object plane(const Owner& owner, const void* first, int of = 0) {
  const py::ssize_t height = owner->truth.height > 0 ? owner->truth.height : owner->color.height,
                    width = owner->truth.width > 0 ? owner->truth.width : owner->color.width;
  std::vector<py::ssize_t> shape{height, width};
  if (of > 0) shape.push_back(of);
  return py::array_t<Number>(shape, static_cast<const Number*>(first), keeper(owner));
}

}  // namespace

PictureArrays::PictureArrays(DrawnPicture picture, py::object rgb)
    : picture_(std::make_shared<DrawnPicture>(std::move(picture))), rgb_(std::move(rgb)) {}

py::object PictureArrays::rgb() const {
  if (!rgb_.is_none()) return rgb_;
  return plane<std::uint8_t>(picture_, picture_->color.pixels.data(), 3);
}

py::object PictureArrays::right_rgb() const {
  if (picture_->right.pixels.empty()) return py::none();
  return plane<std::uint8_t>(picture_, picture_->right.pixels.data(), 3);
}

py::object PictureArrays::depth_mm() const {
  if (!picture_->layers.depth) return py::none();
  return plane<float>(picture_, picture_->truth.depth_mm.data());
}

py::object PictureArrays::normals() const {
  if (!picture_->layers.normals) return py::none();
  return plane<float>(picture_, picture_->truth.normal.data(), 3);
}

py::object PictureArrays::mask() const {
  if (!picture_->layers.mask) return py::none();
  return plane<std::uint8_t>(picture_, picture_->truth.label.data());
}

py::object PictureArrays::skin() const {
  if (!picture_->layers.id) return py::none();
  static_assert(sizeof(BoundPixel) == 24);
  const auto offset = [](auto BoundPixel::*member) {
    static const BoundPixel pixel;
    return py::int_(reinterpret_cast<const char*>(&(pixel.*member)) -
                    reinterpret_cast<const char*>(&pixel));
  };
  py::list names, formats, offsets;
  const auto field = [&](const char* name, const char* format, const py::int_& at) {
    names.append(name), formats.append(format), offsets.append(at);
  };
  field("face", "u4", offset(&BoundPixel::face));
  field("b1", "f4", offset(&BoundPixel::b1));
  field("b2", "f4", offset(&BoundPixel::b2));
  field("height_mm", "f4", offset(&BoundPixel::height_mm));
  const py::dtype type(names, formats, offsets, sizeof(BoundPixel));
  return py::array(type, {py::ssize_t(picture_->truth.height), py::ssize_t(picture_->truth.width)},
                   picture_->truth.bound.data(), keeper(picture_));
}

py::object PictureArrays::organ() const {
  if (!picture_->layers.id || picture_->truth.organ.empty()) return py::none();
  return plane<std::uint8_t>(picture_, picture_->truth.organ.data());
}

py::object PictureArrays::weight() const {
  if (!picture_->layers.weight) return py::none();
  const PixelTruth& truth = picture_->truth;
  const py::ssize_t row = py::ssize_t(sizeof(BoundPixel)) * truth.width;
  return py::array(py::dtype::of<float>(), {py::ssize_t(truth.height), py::ssize_t(truth.width)},
                   {row, py::ssize_t(sizeof(BoundPixel))}, &truth.bound.data()->weight,
                   keeper(picture_));
}

py::object PictureArrays::flow_back() const {
  if (!picture_->has_flow) return py::none();
  return plane<float>(picture_, picture_->backward.px.data(), 2);
}
py::object PictureArrays::flow_back_seen() const {
  if (!picture_->has_flow) return py::none();
  return plane<bool>(picture_, picture_->backward.seen.data());
}
py::object PictureArrays::flow_from_last() const {
  if (!picture_->has_flow) return py::none();
  return plane<float>(picture_, picture_->forward.px.data(), 2);
}
py::object PictureArrays::flow_from_last_seen() const {
  if (!picture_->has_flow) return py::none();
  return plane<bool>(picture_, picture_->forward.seen.data());
}

namespace {

using Mesh = EmbeddedPlayer::Mesh;
using MeshOwner = std::shared_ptr<Mesh>;

// An array over a list of the mesh, which it keeps alive.
py::capsule keeper_of(const MeshOwner& owner) {
  return py::capsule(new MeshOwner(owner),
                     [](void* kept) { delete static_cast<MeshOwner*>(kept); });
}
template <class Number>
py::array array_over(const MeshOwner& owner, const std::vector<Number>& list) {
  return py::array_t<Number>(static_cast<py::ssize_t>(list.size()), list.data(), keeper_of(owner));
}
template <class Number, std::size_t Columns>
py::array array_over(const MeshOwner& owner, const std::vector<std::array<Number, Columns>>& list) {
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(list.size()),
                                       static_cast<py::ssize_t>(Columns)};
  return py::array_t<Number>(shape, reinterpret_cast<const Number*>(list.data()), keeper_of(owner));
}

using MeshClass = py::class_<Mesh, MeshOwner>;

template <class List>
void def_list(MeshClass& mesh, const char* name, List Mesh::*member, const char* doc) {
  mesh.def_property_readonly(
      name, [member](const MeshOwner& owner) { return array_over(owner, (*owner).*member); }, doc);
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
