// SPDX-License-Identifier: Apache-2.0
#include "bind_step.h"

#include <pybind11/numpy.h>

#include <array>
#include <string>

#include "array_arguments.h"
#include "organbake/core/error.h"
#include "organbake/player/tip_instruments.h"

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

StepReport step(SharedPlayer& player, const py::object& positions_mm, const py::object& radius_mm,
                const py::object& axis_mm, const py::object& grabs, const py::object& cuts,
                const py::object& snips, const py::object& opening_mm,
                const py::object& cut_width_mm, const py::object& pierces,
                const py::object& active) {
  const auto positions = vectors_from(positions_mm, "positions_mm");
  std::vector<Tip> tips(positions.size());
  for (std::size_t i = 0; i < tips.size(); ++i)
    tips[i].position_mm = {positions[i].x(), positions[i].y(), positions[i].z()};
  take_numbers(radius_mm, "radius_mm", &Tip::radius_mm, tips);
  take_numbers(cut_width_mm, "cut_width_mm", &Tip::cut_width_mm, tips);
  take_flags(grabs, "grabs", &Tip::grabs, tips);
  take_flags(cuts, "cuts", &Tip::cuts, tips);
  take_flags(snips, "snips", &Tip::snips, tips);
  take_flags(pierces, "pierces", &Tip::pierces, tips);
  take_flags(active, "active", &Tip::active, tips);
  take_vectors(axis_mm, "axis_mm", &Tip::axis_mm, tips);
  take_vectors(opening_mm, "opening_mm", &Tip::opening_mm, tips);
  const auto instruments = instruments_from(tips);
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
  player.def(
      "step", &step, py::arg("positions_mm") = py::list(), py::kw_only(),
      py::arg("radius_mm") = 5.0, py::arg("axis_mm") = py::none(), py::arg("grabs") = false,
      py::arg("cuts") = false, py::arg("snips") = false, py::arg("opening_mm") = py::none(),
      py::arg("cut_width_mm") = 0.0, py::arg("pierces") = false, py::arg("active") = true,
      "One time step under n tips. positions_mm: (n, 3); a tip keeps its place in the list "
      "from step to step. radius_mm, cut_width_mm, grabs, cuts, snips, pierces, active: one "
      "for all, or (n,). axis_mm: (n, 3), to a capsule's other end; None: spheres. A tip "
      "that cuts is a blade whose edge is its axis; one that snips a pair of scissors, whose "
      "axis leads from the closed blades' tips to their pivot: they cut as opening_mm, (n, "
      "3), from the one tip to the other, becomes less. What is cut parts a few steps later, "
      "of the solver fem alone; cut_width_mm is taken away across the blade's way. One that "
      "pierces is a needle along its axis. Returns a Step. Raises ValueError for a tip that "
      "makes no sense.");
}

}  // namespace organbake
