// SPDX-License-Identifier: Apache-2.0
#include "bind_states.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <string>
#include <utility>
#include <vector>

#include "array_arguments.h"
#include "organbake/core/error.h"
#include "organbake/player/organ_mesh.h"
#include "tip_arguments.h"

namespace organbake {
namespace py = pybind11;
namespace {

// The pictures of a batch, as arrays of (n, h, w, …); what was not asked for is None.
struct Pictures {
  py::object rgb = py::none(), depth_mm = py::none(), mask = py::none(), flow_back = py::none(),
             flow_back_seen = py::none();
};

template <class Number>
Number* make_plane(py::object& array, std::vector<py::ssize_t> shape) {
  py::array_t<Number> made(std::move(shape));
  Number* const data = made.mutable_data();
  array = std::move(made);
  return data;
}

BatchPlanes make_planes(Pictures& pictures, py::ssize_t count, const View& view,
                        const LayerSet& layers) {
  const py::ssize_t height = view.camera.intrinsics.height, width = view.camera.intrinsics.width;
  BatchPlanes planes;
  planes.rgb = make_plane<std::uint8_t>(pictures.rgb, {count, height, width, 3});
  if (layers.depth) planes.depth_mm = make_plane<float>(pictures.depth_mm, {count, height, width});
  if (layers.mask) planes.mask = make_plane<std::uint8_t>(pictures.mask, {count, height, width});
  if (layers.flow) {
    planes.flow_back = make_plane<float>(pictures.flow_back, {count, height, width, 2});
    planes.flow_seen = reinterpret_cast<std::uint8_t*>(
        make_plane<bool>(pictures.flow_back_seen, {count, height, width}));
  }
  return planes;
}

LayerSet batch_layers(const std::string& text) {
  const LayerSet layers = text.empty() ? LayerSet() : layers_from(text);
  if (layers.normals || layers.id || layers.weight)
    throw UsageError("layers is '" + text + "'; of many pictures there are depth, flow and mask");
  return layers;
}

std::vector<View> views_from(const py::object& given) {
  if (py::isinstance<View>(given)) return {py::cast<View>(given)};
  try {
    return py::cast<std::vector<View>>(given);
  } catch (const py::cast_error&) {
    throw UsageError("views must be a View, or a list of them");
  }
}

Pictures draw_many(SharedPlayer& player, const py::object& states, const py::object& views,
                   const std::string& layers, bool nodes) {
  const LayerSet set = batch_layers(layers);
  const std::vector<View> seen_from = views_from(views);
  const RawNumbers numbers = raw_numbers(states, "states", 3);
  StateBatch batch;
  batch.count = numbers.rows;
  batch.of = nodes ? StateOf::nodes : StateOf::vertices;
  batch.xyz_mm = numbers.values;
  for (const View& view : seen_from) view.check();
  Pictures pictures;
  if (seen_from.empty())
    throw UsageError("views is empty; there must be one, or one for each state");
  const BatchPlanes planes =
      make_planes(pictures, static_cast<py::ssize_t>(batch.count), seen_from.front(), set);
  const py::gil_scoped_release release;
  player.draw_many(batch, seen_from, planes);
  return pictures;
}

void set_state(SharedPlayer& player, StateOf of, const py::object& positions_mm,
               std::size_t organ) {
  const RawNumbers numbers = raw_numbers(positions_mm, "positions_mm", 2);
  const py::gil_scoped_release release;
  player.set_state(numbers.values, of, organ);
}

py::object contact_forces(SharedPlayer& player, const std::vector<Instrument>& instruments,
                          std::size_t organ, bool nodes) {
  std::vector<Eigen::Vector3d> forces;
  {
    const py::gil_scoped_release release;
    forces = player.contact_forces(instruments, organ, nodes);
  }
  return array_of(forces);
}

constexpr const char* kSetDoc =
    "World mm, a C-contiguous float32 or float64 array, read where it lies. draw() and its layers "
    "then show what they would after a step that ended there; step() goes on from there: the "
    "tissue lies still in that moment, its anchors at rest, and tips begin anew with what they "
    "touch. Raises ValueError, and changes nothing, for another count, for what is not finite and "
    "for what cannot be this organ's: another organ's, or in another unit.";

void bind_pictures(py::module_& m) {
  py::class_<Pictures>(m, "Pictures", "Many pictures and their layers; the others are None.")
      .def_readonly("rgb", &Pictures::rgb, "(n, h, w, 3) uint8, sRGB.")
      .def_readonly("depth_mm", &Pictures::depth_mm,
                    "(n, h, w) float32: planar z, +inf at the background.")
      .def_readonly("mask", &Pictures::mask, "(n, h, w) uint8: 0 background, 1 organ.")
      .def_readonly("flow_back", &Pictures::flow_back,
                    "(n, h, w, 2) float32: from each picture to the one before it, px; 0 of the "
                    "first.")
      .def_readonly("flow_back_seen", &Pictures::flow_back_seen,
                    "(n, h, w) bool: whether that picture shows the point as well.");
}

}  // namespace

void bind_states(py::module_& m, py::class_<SharedPlayer, std::shared_ptr<SharedPlayer>>& player) {
  bind_pictures(m);
  const auto setter = [&](const char* name, StateOf of, const char* of_what) {
    player.def(
        name,
        [of](SharedPlayer& self, const py::object& positions_mm, std::size_t organ) {
          set_state(self, of, positions_mm, organ);
        },
        py::arg("positions_mm"), py::arg("organ") = 0,
        (std::string("Another solver's state of an organ: (n, 3), where ") + of_what + " lie. " +
         kSetDoc)
            .c_str());
  };
  setter("set_vertices", StateOf::vertices, "the proxy's vertices");
  setter("set_nodes", StateOf::nodes, "the nodes of its tetrahedra");
  player.def(
      "mesh",
      [](SharedPlayer& self, std::size_t organ) {
        const py::gil_scoped_release release;
        return self.mesh(organ);
      },
      py::arg("organ") = 0,
      "What another solver needs of an organ: a Mesh, of it as it is cut now.");
  def_with_tips(
      player, "contact_forces", &contact_forces,
      "For solvers without contact: (n, 3), the force (N, world) on each vertex of an organ's "
      "proxy, or with nodes=True on each node of its tetrahedra, that keeps the tissue off the "
      "tips, given as step() takes them, or carries it, for one time step. The tissue lies still "
      "afterwards, where it was.",
      py::arg("organ") = 0, py::arg("nodes") = false);
  player.def(
      "draw_many", &draw_many, py::arg("states"), py::arg("views"), py::arg("layers") = "",
      py::kw_only(), py::arg("nodes") = false,
      "Draws many states of the first organ at once, a thread for each, and leaves the "
      "player as it is. states: (n, vertices, 3) float32 or float64, as set_vertices() "
      "takes them, or with nodes=True as set_nodes(). views: a View for all, or a list of "
      "one for each, of one size. layers: of depth, flow, mask, comma-separated; flow is to "
      "the state before. Returns Pictures: the same as setting and drawing them one by one.");
}

}  // namespace organbake
