// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace organbake {

// The kinds of instruments, each with the properties that no other has.

// Holds tissue off and pushes it: a probe, a swab, the back of any tool.
struct Ball {
  bool operator==(const Ball&) const = default;
};

// Carries the tissue that its tip touched when it closed.
struct Grasper {
  bool operator==(const Grasper&) const = default;
};

// A scalpel or a hook: its axis is an edge that cuts what it sweeps through, and pushes nothing.
struct Blade {
  // How much tissue it takes away across its way: nothing of a scalpel, a millimetre or two of a
  // hook with current.
  double cut_width_mm = 0;

  bool operator==(const Blade&) const = default;
};

// Its axis leads from where its blades meet when they are closed to their pivot. It pushes nothing;
// what lies between the blades is cut as the opening becomes less.
struct Scissors {
  double cut_width_mm = 0;
  // From the tip of the one blade to that of the other, half of it on either side of the position.
  Eigen::Vector3d opening_mm = Eigen::Vector3d::Zero();

  bool operator==(const Scissors&) const = default;
};

// Leads from its point along its axis. It pushes the skin in until that gives way and lets it
// through. From then on the skin slides along the needle and is held by its friction, until the
// point comes out again.
struct Needle {
  bool operator==(const Needle&) const = default;
};

using InstrumentKind = std::variant<Ball, Grasper, Blade, Scissors, Needle>;

// One instrument at one moment: world, millimetres. Its tip is a sphere about the position, or a
// capsule: all that lies within the radius of an axis that begins there.
struct Instrument {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  double radius_mm = 5;  // from kThinnestTip_mm on
  InstrumentKind kind = Ball{};
  bool active = false;                                // an inactive one is not there at all
  Eigen::Vector3d axis_mm = Eigen::Vector3d::Zero();  // to the capsule's other end; zero: a sphere

  template <class Kind>
  bool is() const {
    return std::holds_alternative<Kind>(kind);
  }
  bool is_blunt() const { return is<Ball>() || is<Grasper>(); }
  Eigen::Vector3d end_mm() const { return position_mm + axis_mm; }

  bool operator==(const Instrument&) const = default;
};

inline bool has_blade(const InstrumentKind& kind) {
  return std::holds_alternative<Blade>(kind) || std::holds_alternative<Scissors>(kind);
}

// A thinner tip would slip between what contacts are exact to.
inline constexpr double kThinnestTip_mm = 0.05;
inline constexpr double kShortestBlade_mm = 0.1;
inline constexpr double kWidestCut_mm = 10;
inline constexpr std::size_t kMostInstruments = 1024;  // of one step: each holds off every other

// A number that only some kinds have.
struct InstrumentNumber {
  const char* name;   // in every document, message and argument
  const char* title;  // on a screen, with a place for the number
  double least, most;
  double usual;  // as far as a slider goes
};

// Calls visit(InstrumentNumber, double&) for each such number of a kind, or of whatever has members
// of the same names. This is the only list of them: checks, scripts, recordings, the window, pages,
// Python and embedding programs follow it.
template <class Kind, class Visit>
void each_number(Kind& kind, const Visit& visit) {
  if constexpr (requires { kind.cut_width_mm; })
    visit(InstrumentNumber{"cut_width_mm", "takes away %.1f mm", 0, kWidestCut_mm, 4},
          kind.cut_width_mm);
}
// Of whichever kind it is.
template <class AnyKind, class Visit>
void each_number_of(AnyKind& kind, const Visit& visit) {
  std::visit([&](auto& own) { each_number(own, visit); }, kind);
}

// What each kind does, in the order of InstrumentKind: its name in scripts, panels and records.
inline constexpr std::array<const char*, std::variant_size_v<InstrumentKind>> kInstrumentModes = {
    "poke", "grab", "cut", "snip", "pierce"};
inline const char* mode_of(const InstrumentKind& kind) { return kInstrumentModes[kind.index()]; }
// Every kind once, in that order, with the properties that it has by default.
const std::array<InstrumentKind, std::variant_size_v<InstrumentKind>>& instrument_kinds();
// Nothing for another name.
std::optional<InstrumentKind> kind_of_mode(std::string_view mode);

// Throws UsageError that names the first instrument that makes no sense, and why. Inactive ones may
// hold anything.
void check_instruments(const std::vector<Instrument>& instruments);

// Where a tip is at a time: at a place of the world, or pressed depth_mm below the skin (above it
// when negative) where the line from the organ's centre along `direction` leaves it at rest.
struct Waypoint {
  double time_s = 0;
  std::optional<Eigen::Vector3d> position_mm;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  double depth_mm = 0;
  double opening_mm = 0;  // between the tips of scissors' blades
};

// What an instrument does in a script: key frames, and all of it that stays.
struct InstrumentPath {
  std::string name;
  // Of radius 0: the bundle's default tool. The opening of scissors is the direction in which they
  // open, of any length but zero: how far, the waypoints tell.
  Instrument instrument = {.radius_mm = 0};
  // Strictly later each; the tip is away before the first and after the last.
  std::vector<Waypoint> path = {};
  // How the tool looks, which nothing that it does depends on: where its shaft leads at all times,
  // any length, or the place of the world that it comes through and turns about. Neither: the
  // player chooses such a place, once for the whole path.
  std::optional<Eigen::Vector3d> shaft = {}, trocar_mm = {};

  // The instrument at a time: linear between waypoints, all of which must have their places of the
  // world; inactive before the first and after the last.
  Instrument at(double time_s) const;
};

// One instrument's way through a time step: in a straight line, its axis likewise.
struct InstrumentSweep {
  std::uint32_t instrument = 0;  // its place in the list
  Instrument from, to;           // but for position and axis they are the same
  // No earlier place is known: skin that the tip overlaps counts as entered from outside.
  bool just_placed = false;

  Eigen::Vector3d position_mm(double fraction) const {
    return from.position_mm + fraction * (to.position_mm - from.position_mm);
  }
  Eigen::Vector3d axis_mm(double fraction) const {
    return from.axis_mm + fraction * (to.axis_mm - from.axis_mm);
  }
  // Of the place `along` (0…1) the axis.
  Eigen::Vector3d motion_mm(double along) const {
    return (to.position_mm - from.position_mm) + along * (to.axis_mm - from.axis_mm);
  }
};

// Whether nothing about the active instruments differs by more than rounding.
bool unchanged(const std::vector<Instrument>& before, const std::vector<Instrument>& now);

// The way of every active instrument, in their order. One that was not there before, or was of
// another kind, is just placed.
std::vector<InstrumentSweep> sweeps_between(const std::vector<Instrument>& before,
                                            const std::vector<Instrument>& now);

}  // namespace organbake
