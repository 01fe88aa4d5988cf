// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/json_fields.h"
#include "organbake/player/script.h"
#include "script_camera_json.h"

namespace organbake {
namespace {

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

Json instrument_json(const InstrumentPath& instrument) {
  Json json = {
      {"name", instrument.name}, {"mode", to_string(instrument.mode)}, {"path", Json::array()}};
  if (instrument.radius_mm > 0) json["radius_mm"] = instrument.radius_mm;
  if (!instrument.axis_mm.isZero(0)) json["axis_mm"] = to_json(instrument.axis_mm);
  if (instrument.cut_width_mm > 0) json["cut_width_mm"] = instrument.cut_width_mm;
  if (instrument.mode == InstrumentMode::snip)
    json["opens_along"] = to_json(instrument.opens_along);
  if (instrument.shaft) json["shaft"] = to_json(*instrument.shaft);
  for (const Waypoint& waypoint : instrument.path) json["path"].push_back(waypoint_json(waypoint));
  return json;
}

}  // namespace

std::string script_to_json(const Script& script) {
  Json instruments = Json::array();
  for (const InstrumentPath& i : script.instruments) instruments.push_back(instrument_json(i));
  Json json = {{"schema", "organbake/interaction/1"},  {"name", script.name},
               {"time_step_s", script.time_step_s},    {"frames", script.frames},
               {"camera", script_camera_json(script)}, {"instruments", instruments}};
  if (script.width > 0 && script.height > 0) json["size"] = {script.width, script.height};
  if (script.solver) json["solver"] = to_string(*script.solver);
  if (script.light) json["light"] = to_string(*script.light);
  return json_text(json);
}

}  // namespace organbake
