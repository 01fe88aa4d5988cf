// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <vector>

#include "organbake/instruments/instrument.h"
#include "shared_player.h"

namespace organbake {

// What Python tells of tips, each for all of them or one by one.
struct TipArguments {
  const pybind11::object &positions_mm, &radius_mm, &axis_mm, &grabs, &cuts, &snips, &opening_mm,
      &cut_width_mm, &pierces, &active;

  // Throws UsageError naming the argument.
  std::vector<Instrument> instruments() const;
};

// A method of tips: work(player, instruments, more…), whose further arguments are keywords, too.
template <class Class, class... More, class Result>
void def_with_tips_as(Class& player, const char* name,
                      Result (*work)(SharedPlayer&, const std::vector<Instrument>&, More...),
                      const char* doc, const auto&... more) {
  namespace py = pybind11;
  using Given = const py::object&;
  player.def(
      name,
      [work](SharedPlayer& self, Given positions_mm, Given radius_mm, Given axis_mm, Given grabs,
             Given cuts, Given snips, Given opening_mm, Given cut_width_mm, Given pierces,
             Given active, More... rest) {
        const TipArguments tips{positions_mm, radius_mm,  axis_mm,      grabs,   cuts,
                                snips,        opening_mm, cut_width_mm, pierces, active};
        return work(self, tips.instruments(), rest...);
      },
      py::arg("positions_mm") = py::list(), py::kw_only(), py::arg("radius_mm") = 5.0,
      py::arg("axis_mm") = py::none(), py::arg("grabs") = false, py::arg("cuts") = false,
      py::arg("snips") = false, py::arg("opening_mm") = py::none(), py::arg("cut_width_mm") = 0.0,
      py::arg("pierces") = false, py::arg("active") = true, more..., doc);
}
template <class Class>
void def_with_tips(Class& player, const char* name, auto work, const char* doc,
                   const auto&... more) {
  def_with_tips_as(player, name, +work, doc, more...);
}

}  // namespace organbake
