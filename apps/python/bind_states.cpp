// SPDX-License-Identifier: Apache-2.0
// Python's step() and the states of other solvers: tips from arrays, what a step answers, and many
// states drawn at once.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "array_arguments.h"
#include "organbake/core/error.h"
#include "organbake/player/embedded_types.h"
#include "player_bindings.h"

namespace organbake {
namespace py = pybind11;
namespace {

using Tip = EmbeddedPlayer::Tip;

// Each takes one of step()'s arguments: one for all tips, or one each.
void take_numbers(const py::object& given, const char* name, double Tip::*of,
                  std::vector<Tip>& tips) {
  const auto numbers = numbers_from(given, name, tips.size());
  for (std::size_t i = 0; i < tips.size(); ++i) tips[i].*of = numbers[i];
}

void take_flags(const py::object& given, const char* name, bool Tip::*of, std::vector<Tip>& tips) {
  const auto flags = flags_from(given, name, tips.size());
  for (std::size_t i = 0; i < tips.size(); ++i) tips[i].*of = flags[i];
}

void take_vectors(const py::object& given, const char* name, std::array<double, 3> Tip::*of,
                  std::vector<Tip>& tips) {
  if (given.is_none()) return;
  const auto vectors = vectors_from(given, name);
  if (vectors.size() != tips.size())
    throw UsageError(std::string(name) + " holds " + std::to_string(vectors.size()) + " rows for " +
                     std::to_string(tips.size()) + " tips");
  for (std::size_t i = 0; i < tips.size(); ++i)
    tips[i].*of = {vectors[i].x(), vectors[i].y(), vectors[i].z()};
}

// The numbers that kinds have of their own: whichever names each_number() knows.
void take_numbers_of_kinds(const py::kwargs& given, std::vector<Tip>& tips) {
  Tip usual;
  std::size_t known = 0;
  each_number(usual, [&](const InstrumentNumber& number, double) {
    if (!given.contains(number.name)) return;
    ++known;
    const auto values = numbers_from(given[number.name], number.name, tips.size());
    for (std::size_t i = 0; i < tips.size(); ++i)
      each_number(tips[i], [&](const InstrumentNumber& own, double& value) {
        if (std::string_view(own.name) == number.name) value = values[i];
      });
  });
  if (known == given.size()) return;
  std::string names = "a tip takes no argument of these names:";
  for (const auto& [name, value] : given) names += " " + std::string(py::str(name));
  throw py::type_error(names);
}

}  // namespace

std::vector<Instrument> TipArguments::instruments() const {
  const auto positions = vectors_from(positions_mm, "positions_mm");
  std::vector<Tip> tips(positions.size());
  for (std::size_t i = 0; i < tips.size(); ++i)
    tips[i].position_mm = {positions[i].x(), positions[i].y(), positions[i].z()};
  take_numbers(radius_mm, "radius_mm", &Tip::radius_mm, tips);
  take_flags(grabs, "grabs", &Tip::grabs, tips);
  take_flags(cuts, "cuts", &Tip::cuts, tips);
  take_flags(snips, "snips", &Tip::snips, tips);
  take_flags(pierces, "pierces", &Tip::pierces, tips);
  take_flags(active, "active", &Tip::active, tips);
  take_vectors(axis_mm, "axis_mm", &Tip::axis_mm, tips);
  take_vectors(opening_mm, "opening_mm", &Tip::opening_mm, tips);
  take_numbers_of_kinds(numbers, tips);
  return instruments_from(tips);
}

namespace {

// A contact as a row of NumPy's.
struct ContactRow {
  std::uint32_t instrument, organ;
  std::array<double, 3> position_mm, normal, force_n;
  double depth_mm;
  bool carried;
};

py::array_t<ContactRow> contact_rows(const std::vector<ContactPoint>& points) {
  const auto numbers = [](const Eigen::Vector3d& v) {
    return std::array<double, 3>{v.x(), v.y(), v.z()};
  };
  std::vector<ContactRow> rows;
  for (const ContactPoint& p : points)
    rows.push_back({static_cast<std::uint32_t>(p.instrument), static_cast<std::uint32_t>(p.organ),
                    numbers(p.position_mm), numbers(p.normal), numbers(p.force_n), p.depth_mm,
                    p.carried});
  const auto count = static_cast<py::ssize_t>(rows.size());
  return array_of<ContactRow>(std::move(rows), {count});
}

StepReport step(SharedPlayer& player, const std::vector<Instrument>& instruments) {
  const py::gil_scoped_release release;
  return player.step(instruments);
}

void bind_step_class(py::module_& m) {
  PYBIND11_NUMPY_DTYPE(ContactRow, instrument, organ, position_mm, normal, force_n, depth_mm,
                       carried);
  py::class_<StepReport>(m, "Step", "What one time step did.")
      .def_property_readonly(
          "forces_n", [](const StepReport& s) { return rows_of(s.tip_force_n); },
          "(n, 3): on each tip, from the tissue, world.")
      .def_property_readonly(
          "positions_mm", [](const StepReport& s) { return rows_of(s.tip_position_mm); },
          "(n, 3): where each tip was held; tools hold each other off.")
      .def_property_readonly(
          "contact_points", [](const StepReport& s) { return contact_rows(s.contact_points); },
          "(contacts,) of instrument, organ, position_mm (3; of the skin, world), normal (3; unit, "
          "from the tissue to the instrument), force_n (3; on the instrument: a tip's force is "
          "their sum), depth_mm (of the skin below its place at rest), carried (by a grasper).")
      .def_readonly("contacts", &StepReport::contacts, "Of tips with tissue.")
      .def_readonly("tissue_contacts", &StepReport::tissue_contacts, "Of tissue with tissue.")
      .def_readonly("tool_contacts", &StepReport::tool_contacts, "Pairs of tools that touch.")
      .def_readonly("penetration_mm", &StepReport::penetration_mm,
                    "The deepest skin point left inside a tip.")
      .def_readonly("slipped", &StepReport::slipped,
                    "How many graspers the tissue slipped from, which it could not follow.")
      .def_readonly("recovered", &StepReport::recovered, "A lost state went back to rest.")
      .def_readonly("tip_too_fast", &StepReport::tip_too_fast,
                    "A tip moved farther than can be followed.");
}

}  // namespace

void bind_step(py::module_& m, py::class_<SharedPlayer, std::shared_ptr<SharedPlayer>>& player) {
  bind_step_class(m);
  def_with_tips(
      player, "step", &step,
      "One time step under n tips. positions_mm: (n, 3); a tip keeps its place in the list "
      "from step to step. radius_mm, cut_width_mm, grabs, cuts, snips, pierces, active: one "
      "for all, or (n,). axis_mm: (n, 3), to a capsule's other end; None: spheres. A tip "
      "that cuts is a blade whose edge is its axis; one that snips a pair of scissors, whose "
      "axis leads from the closed blades' tips to their pivot: they cut as opening_mm, (n, "
      "3), from the one tip to the other, becomes less. What is cut parts a few steps later, "
      "of finite elements alone; cut_width_mm is taken away across the blade's way. One that "
      "pierces is a needle along its axis. Returns a Step. Raises ValueError for a tip that "
      "makes no sense.");
  def_with_tips(
      player, "place_tools",
      [](SharedPlayer& self, const std::vector<Instrument>& instruments) {
        const py::gil_scoped_release release;
        self.place_tools(instruments);
      },
      "Tools for the next pictures alone, until the next step: n tips as step() takes them, which "
      "push nothing. For states that set_vertices() and set_nodes() set.");
}

namespace {

// The pictures of a batch, as arrays of (n, h, w, …); what was not asked for is None.
struct Pictures {
  py::object rgb = py::none(), depth_mm = py::none(), normals = py::none(), mask = py::none(),
             flow_back = py::none(), flow_back_seen = py::none();
};

BatchPlanes make_planes(Pictures& pictures, py::ssize_t count, const View& view,
                        const LayerSet& layers) {
  const py::ssize_t height = view.camera.intrinsics.height, width = view.camera.intrinsics.width;
  BatchPlanes planes;
  planes.rgb = room_in<std::uint8_t>(pictures.rgb, "out: rgb", {count, height, width, 3});
  if (layers.depth)
    planes.depth_mm = room_in<float>(pictures.depth_mm, "out: depth_mm", {count, height, width});
  if (layers.normals)
    planes.normals = room_in<float>(pictures.normals, "out: normals", {count, height, width, 3});
  if (layers.mask)
    planes.mask = room_in<std::uint8_t>(pictures.mask, "out: mask", {count, height, width});
  if (layers.flow) {
    planes.flow_back =
        room_in<float>(pictures.flow_back, "out: flow_back", {count, height, width, 2});
    planes.flow_seen = reinterpret_cast<std::uint8_t*>(
        room_in<bool>(pictures.flow_back_seen, "out: flow_back_seen", {count, height, width}));
  }
  return planes;
}

LayerSet batch_layers(const py::object& given) {
  const LayerSet layers = layer_set_from(given);
  if (layers.id || layers.weight)
    throw UsageError("layers is " + std::string(py::repr(given)) +
                     "; of many pictures there are depth, flow, normals and mask");
  return layers;
}

// The caller's arrays to draw into: those of earlier Pictures, or one array of colours.
Pictures room_of(const py::object& out) {
  if (py::isinstance<Pictures>(out)) return py::cast<Pictures>(out);
  Pictures room;
  if (out.is_none()) return room;
  if (!py::isinstance<py::array>(out))
    throw UsageError("out must be Pictures of an earlier call, or an array for rgb");
  room.rgb = out;
  return room;
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
                   const py::object& layers, bool nodes, const py::object& out, std::size_t organ) {
  const LayerSet set = batch_layers(layers);
  const std::vector<View> seen_from = views_from(views);
  const RawNumbers numbers = raw_numbers(states, "states", 3);
  StateBatch batch;
  batch.count = numbers.rows;
  batch.of = nodes ? StateOf::nodes : StateOf::vertices;
  batch.xyz_mm = numbers.values;
  for (const View& view : seen_from) view.check();
  Pictures pictures = room_of(out);
  if (seen_from.empty())
    throw UsageError("views is empty; there must be one, or one for each state");
  const BatchPlanes planes =
      make_planes(pictures, static_cast<py::ssize_t>(batch.count), seen_from.front(), set);
  const py::gil_scoped_release release;
  player.draw_many(batch, seen_from, organ, planes);
  return pictures;
}

void set_state(SharedPlayer& player, StateOf of, const py::object& positions_mm,
               std::size_t organ) {
  const RawNumbers numbers = raw_numbers(positions_mm, "positions_mm", 2);
  player.with([&](Player& open) {
    std::visit(
        [&](const auto& xyz) {
          of == StateOf::nodes ? open.set_nodes(xyz, organ) : open.set_vertices(xyz, organ);
        },
        numbers.values);
  });
}

py::object contact_forces(SharedPlayer& player, const std::vector<Instrument>& instruments,
                          std::size_t organ, bool nodes) {
  return rows_of(player.with([&](Player& open) {
    const auto forces = open.contact_force_n(instruments, organ);
    return nodes ? forces_on_nodes(open.bundle_now(organ), forces) : forces;
  }));
}

constexpr const char* kSetDoc =
    "World mm, a float32 or float64 array or buffer, or an object with __dlpack__; read where it "
    "lies "
    "if its numbers follow each other. draw() and its layers "
    "then show what they would after a step that ended there; step() goes on from there: the "
    "tissue lies still in that moment, its anchors at rest, and tips begin anew with what they "
    "touch. Raises ValueError, and changes nothing, for another count, for what is not finite and "
    "for what cannot be this organ's: another organ's, or in another unit.";

void bind_pictures(py::module_& m) {
  py::class_<Pictures>(m, "Pictures", "Many pictures and their layers; the others are None.")
      .def_readonly("rgb", &Pictures::rgb, "(n, h, w, 3) uint8, sRGB.")
      .def_readonly("depth_mm", &Pictures::depth_mm,
                    "(n, h, w) float32: planar z, +inf at the background.")
      .def_readonly("normals", &Pictures::normals,
                    "(n, h, w, 3) float32, camera axes, unit, towards the eye; 0 at the "
                    "background.")
      .def_readonly("mask", &Pictures::mask, "(n, h, w) uint8: 0 background, 1 organ.")
      .def_readonly("flow_back", &Pictures::flow_back,
                    "(n, h, w, 2) float32: from each picture to the one before it, px; 0 of the "
                    "first.")
      .def_readonly("flow_back_seen", &Pictures::flow_back_seen,
                    "(n, h, w) bool: whether that picture shows the point as well.");
}

void bind_saved_states(py::module_& m,
                       py::class_<SharedPlayer, std::shared_ptr<SharedPlayer>>& player) {
  py::class_<SharedPlayer::State>(
      m, "State", "A moment between two steps that Player.save_state() has kept, of that player.")
      .def_property_readonly(
          "steps", [](const SharedPlayer::State& s) { return s.moment.steps(); }, "From rest.");
  const auto released = py::call_guard<py::gil_scoped_release>();
  player
      .def("save_state", &SharedPlayer::save_state, released,
           "This moment, to go back to: how the organs lie and move, what is cut, what tips hold. "
           "Returns a State, which is kept in memory.")
      .def("restore_state", &SharedPlayer::restore_state, py::arg("state"), released,
           "Back to a State of this player's: steps and pictures that follow are to the byte those "
           "that followed then; flow begins anew. Raises ValueError for another player's.");
}

}  // namespace

void bind_states(py::module_& m, py::class_<SharedPlayer, std::shared_ptr<SharedPlayer>>& player) {
  bind_pictures(m);
  bind_saved_states(m, player);
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
        return self.with(
            [&](const Player& player) { return organ_mesh(player.bundle_now(organ)); });
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
      py::kw_only(), py::arg("nodes") = false, py::arg("out") = py::none(), py::arg("organ") = 0,
      "Draws many states of one organ, alone, at once, a thread for each, and leaves the "
      "player as it is. states: (n, vertices, 3) float32 or float64, as set_vertices() "
      "takes them, or with nodes=True as set_nodes(). views: a View for all, or a list of "
      "one for each, of one size. layers: of depth, flow, normals, mask, comma-separated or a "
      "list; flow is to the state before. out: Pictures of an earlier call, or a uint8 array (n, "
      "h, w, 3), "
      "to draw into. Returns Pictures: the same as setting and drawing them one by one.");
}

}  // namespace organbake
