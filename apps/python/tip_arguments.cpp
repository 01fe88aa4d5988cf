// SPDX-License-Identifier: Apache-2.0
#include "tip_arguments.h"

#include <string>

#include "array_arguments.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

namespace py = pybind11;

std::vector<Eigen::Vector3d> rows_or_zeros(const py::object& rows, const char* name,
                                           std::size_t n) {
  if (rows.is_none()) return std::vector<Eigen::Vector3d>(n, Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector3d> vectors = vectors_from(rows, name);
  if (vectors.size() != n)
    throw UsageError(std::string(name) + " holds " + std::to_string(vectors.size()) + " rows for " +
                     std::to_string(n) + " tips");
  return vectors;
}

}  // namespace

std::vector<InstrumentTip> tips_from(const py::object& positions_mm, const TipArguments& all) {
  const auto positions = vectors_from(positions_mm, "positions_mm");
  const std::size_t n = positions.size();
  const auto radii = numbers_from(all.radius_mm, "radius_mm", n);
  const auto widths = numbers_from(all.cut_width_mm, "cut_width_mm", n);
  const auto grab = flags_from(all.grabs, "grabs", n), cut = flags_from(all.cuts, "cuts", n);
  const auto snip = flags_from(all.snips, "snips", n);
  const auto pierce = flags_from(all.pierces, "pierces", n);
  const auto on = flags_from(all.active, "active", n);
  const auto axes = rows_or_zeros(all.axis_mm, "axis_mm", n);
  const auto openings = rows_or_zeros(all.opening_mm, "opening_mm", n);
  std::vector<InstrumentTip> tips;
  for (std::size_t i = 0; i < n; ++i) {
    const InstrumentMode mode = instrument_mode({grab[i], cut[i], snip[i], pierce[i]}, i);
    tips.push_back({positions[i], radii[i], mode, on[i], axes[i], widths[i], openings[i]});
  }
  return tips;
}

}  // namespace organbake
