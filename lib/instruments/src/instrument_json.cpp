// SPDX-License-Identifier: Apache-2.0
// The numbers of a kind are read and written by the list in each_number(), so that a new one needs
// no line here, and one of another kind is refused instead of passed over.
#include "organbake/instruments/instrument_json.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr double kFar_mm = 1e6;

// Of any length, as long as its square neither vanishes nor overflows: it will be normalised.
Eigen::Vector3d direction_from(const JsonField& field) {
  Eigen::Vector3d direction = field.vector3();
  if (!std::isnormal(direction.squaredNorm()))
    field.fail("is (" + to_text(direction.x()) + ", " + to_text(direction.y()) + ", " +
               to_text(direction.z()) + "), must have a length between 1e-150 and 1e150");
  return direction;
}

Waypoint waypoint_from(const JsonField& field) {
  field.allow_only({"time_s", "direction", "depth_mm", "position_mm", "opening_mm"});
  Waypoint waypoint;
  constexpr double kLongest_s = 1e5;
  waypoint.time_s = field["time_s"].number(0, kLongest_s);
  field.read("opening_mm", 0, kFar_mm, waypoint.opening_mm);
  if (const auto position = field.find("position_mm")) {
    if (field.find("direction") || field.find("depth_mm"))
      position->fail("stands beside direction or depth_mm; a tip is at the one or the other");
    waypoint.position_mm = position->vector3();
    if (waypoint.position_mm->norm() > kFar_mm) position->fail("lies more than a kilometre away");
    return waypoint;
  }
  waypoint.direction = direction_from(field["direction"]);
  waypoint.depth_mm = field["depth_mm"].number(-kFar_mm, kFar_mm);
  return waypoint;
}

std::vector<Waypoint> path_from(const JsonField& path, bool scissors) {
  if (path.size() == 0) path.fail("must hold a waypoint");
  std::vector<Waypoint> waypoints;
  for (std::size_t i = 0; i < path.size(); ++i) {
    waypoints.push_back(waypoint_from(path.at(i)));
    if (i > 0 && waypoints[i].time_s <= waypoints[i - 1].time_s)
      path.at(i)["time_s"].fail("must be later than that of the waypoint before it");
    if (waypoints[i].opening_mm > 0 && !scissors)
      path.at(i)["opening_mm"].fail("is for instruments that snip alone");
  }
  return waypoints;
}

// Visits what kinds have numbers of their own: visit(kind, number).
template <class Visit>
void each_number_of_any(const Visit& visit) {
  for (const InstrumentKind& kind : instrument_kinds())
    each_number_of(kind, [&](const InstrumentNumber& number, double) { visit(kind, number); });
}

std::string modes_with(std::string_view name) {
  std::string modes;
  each_number_of_any([&](const InstrumentKind& kind, const InstrumentNumber& number) {
    if (number.name == name) modes.append(modes.empty() ? "" : " or ").append(mode_of(kind));
  });
  return modes;
}

// Throws for the numbers of other kinds: they would be as if they were not there.
void read_numbers(const JsonField& field, InstrumentKind& kind) {
  std::vector<std::string_view> own;
  const auto read = [&](const InstrumentNumber& number, double& value) {
    own.push_back(number.name);
    if (const auto given = field.find(number.name))
      value = given->number(number.least, number.most);
  };
  each_number_of(kind, read);
  each_number_of_any([&](const InstrumentKind&, const InstrumentNumber& number) {
    if (std::find(own.begin(), own.end(), number.name) != own.end()) return;
    if (const auto given = field.find(number.name))
      given->fail("is for instruments that " + modes_with(number.name) + " alone");
  });
}

// The direction in which scissors open, which the opening holds until a waypoint tells how far.
void read_opening(const JsonField& field, InstrumentKind& kind) {
  const auto along = field.find("opens_along");
  if (Scissors* scissors = std::get_if<Scissors>(&kind)) {
    if (!along) field.fail("snips and needs opens_along: the direction in which its blades open");
    scissors->opening_mm = direction_from(*along);
  } else if (along) {
    along->fail("is for instruments that snip alone");
  }
}

Json waypoint_json(const Waypoint& waypoint) {
  Json json = {{"time_s", waypoint.time_s}};
  if (waypoint.opening_mm > 0) json["opening_mm"] = waypoint.opening_mm;
  if (waypoint.position_mm) {
    json["position_mm"] = to_json(*waypoint.position_mm);
  } else {
    json["direction"] = to_json(waypoint.direction);
    json["depth_mm"] = waypoint.depth_mm;
  }
  return json;
}

}  // namespace

InstrumentPath instrument_from_json(const JsonField& field) {
  std::vector<std::string_view> keys = {"name",        "radius_mm", "mode",      "axis_mm",
                                        "opens_along", "shaft",     "trocar_mm", "path"};
  each_number_of_any([&](const InstrumentKind&, const InstrumentNumber& number) {
    if (std::find(keys.begin(), keys.end(), number.name) == keys.end()) keys.push_back(number.name);
  });
  field.allow_only(keys);
  InstrumentPath read;
  Instrument& instrument = read.instrument;
  read.name = field["name"].text();
  field.read("radius_mm", kThinnestTip_mm, kFar_mm, instrument.radius_mm);
  const JsonField mode = field["mode"];
  const auto kind = kind_of_mode(mode.text());
  if (!kind) mode.fail("must be 'poke', 'grab', 'cut', 'snip' or 'pierce'");
  instrument.kind = *kind;
  if (const auto axis = field.find("axis_mm")) {
    instrument.axis_mm = axis->vector3();
    if (instrument.axis_mm.norm() > kFar_mm) axis->fail("is longer than a kilometre");
  }
  if (!instrument.is_blunt() && !(instrument.axis_mm.norm() >= kShortestBlade_mm))
    field.fail(
        "cuts or pierces and needs axis_mm: its blade's edge or its needle, from the tip to the "
        "upper end, or from the tips of scissors to their pivot, of 0.1 mm at least");
  read_numbers(field, instrument.kind);
  read_opening(field, instrument.kind);
  if (const auto shaft = field.find("shaft")) read.shaft = direction_from(*shaft);
  if (const auto trocar = field.find("trocar_mm")) {
    if (read.shaft) trocar->fail("stands beside shaft; a tool is held by the one or the other");
    read.trocar_mm = trocar->vector3();
    if (read.trocar_mm->norm() > kFar_mm) trocar->fail("lies more than a kilometre away");
  }
  read.path = path_from(field["path"], instrument.is<Scissors>());
  return read;
}

Json to_json(const InstrumentPath& instrument) {
  const Instrument& tip = instrument.instrument;
  Json json = {{"name", instrument.name}, {"mode", mode_of(tip.kind)}, {"path", Json::array()}};
  if (tip.radius_mm > 0) json["radius_mm"] = tip.radius_mm;
  if (!tip.axis_mm.isZero(0)) json["axis_mm"] = to_json(tip.axis_mm);
  const auto write = [&](const InstrumentNumber& number, double value) {
    if (value > 0) json[number.name] = value;
  };
  each_number_of(tip.kind, write);
  if (const Scissors* scissors = std::get_if<Scissors>(&tip.kind))
    json["opens_along"] = to_json(scissors->opening_mm);
  if (instrument.shaft) json["shaft"] = to_json(*instrument.shaft);
  if (instrument.trocar_mm) json["trocar_mm"] = to_json(*instrument.trocar_mm);
  for (const Waypoint& waypoint : instrument.path) json["path"].push_back(waypoint_json(waypoint));
  return json;
}

}  // namespace organbake
