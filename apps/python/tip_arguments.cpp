// SPDX-License-Identifier: Apache-2.0
#include "tip_arguments.h"

#include <array>
#include <string>

#include "array_arguments.h"
#include "organbake/core/error.h"
#include "organbake/player/tip_instruments.h"

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

}  // namespace

std::vector<Instrument> TipArguments::instruments() const {
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
  return instruments_from(tips);
}

}  // namespace organbake
