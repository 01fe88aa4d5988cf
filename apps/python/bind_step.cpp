// SPDX-License-Identifier: Apache-2.0
#include "bind_step.h"

#include <pybind11/numpy.h>

#include <array>
#include <string>

#include "array_arguments.h"
#include "tip_arguments.h"

namespace organbake {
namespace py = pybind11;
namespace {

// A contact as a row of NumPy's.
struct ContactRow {
  std::uint32_t instrument, organ;
  std::array<double, 3> position_mm, normal, force_n;
  double depth_mm;
  bool carried;
};

py::array_t<ContactRow> rows_of(const std::vector<ContactPoint>& points) {
  const auto numbers = [](const Eigen::Vector3d& v) {
    return std::array<double, 3>{v.x(), v.y(), v.z()};
  };
  py::array_t<ContactRow> rows(static_cast<py::ssize_t>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ContactPoint& p = points[i];
    rows.mutable_at(static_cast<py::ssize_t>(i)) = {static_cast<std::uint32_t>(p.instrument),
                                                    static_cast<std::uint32_t>(p.organ),
                                                    numbers(p.position_mm),
                                                    numbers(p.normal),
                                                    numbers(p.force_n),
                                                    p.depth_mm,
                                                    p.carried};
  }
  return rows;
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
          "forces_n", [](const StepReport& s) { return array_of(s.tip_force_n); },
          "(n, 3): on each tip, from the tissue, world.")
      .def_property_readonly(
          "positions_mm", [](const StepReport& s) { return array_of(s.tip_position_mm); },
          "(n, 3): where each tip was held; tools hold each other off.")
      .def_property_readonly(
          "contact_points", [](const StepReport& s) { return rows_of(s.contact_points); },
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

}  // namespace organbake
