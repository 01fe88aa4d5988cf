// SPDX-License-Identifier: Apache-2.0
#include "bind_mesh.h"

#include <pybind11/numpy.h>

#include <array>
#include <memory>
#include <vector>

#include "organbake/player/embedded_player.h"

namespace organbake {
namespace py = pybind11;
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
