// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/script.h"

#include <algorithm>
#include <cmath>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/warp/view.h"
#include "script_camera_json.h"

namespace organbake {
namespace {

constexpr const char* kSchema = "organbake/interaction/1";
constexpr double kFarMm = 1e6;

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
  constexpr double kLongest = 1e5;  // seconds
  waypoint.time_s = field["time_s"].number(0, kLongest);
  if (const auto opening = field.find("opening_mm"))
    waypoint.opening_mm = opening->number(0, kFarMm);
  if (const auto position = field.find("position_mm")) {
    if (field.find("direction") || field.find("depth_mm"))
      position->fail("stands beside direction or depth_mm; a tip is at the one or the other");
    waypoint.position_mm = position->vector3();
    if (waypoint.position_mm->norm() > kFarMm) position->fail("lies more than a kilometre away");
    return waypoint;
  }
  waypoint.direction = direction_from(field["direction"]);
  waypoint.depth_mm = field["depth_mm"].number(-kFarMm, kFarMm);
  return waypoint;
}

void read_blade(const JsonField& field, InstrumentPath& instrument) {
  if (const auto width = field.find("cut_width_mm"))
    instrument.cut_width_mm = width->number(0, kWidestCut_mm);
  if (instrument.mode != InstrumentMode::snip) return;
  const auto along = field.find("opens_along");
  if (!along) field.fail("snips and needs opens_along: the direction in which its blades open");
  instrument.opens_along = direction_from(*along);
}

InstrumentPath instrument_from(const JsonField& field) {
  field.allow_only(
      {"name", "radius_mm", "mode", "axis_mm", "cut_width_mm", "opens_along", "shaft", "path"});
  InstrumentPath instrument;
  instrument.name = field["name"].text();
  if (const auto radius = field.find("radius_mm"))
    instrument.radius_mm = radius->number(kThinnestTip_mm, kFarMm);
  const JsonField mode = field["mode"];
  const auto known = instrument_mode(mode.text());
  if (!known) mode.fail("must be 'poke', 'grab', 'cut', 'snip' or 'pierce'");
  instrument.mode = *known;
  if (const auto axis = field.find("axis_mm")) {
    instrument.axis_mm = axis->vector3();
    if (instrument.axis_mm.norm() > kFarMm) axis->fail("is longer than a kilometre");
  }
  if (!is_blunt(instrument.mode) && !(instrument.axis_mm.norm() >= kShortestBlade_mm))
    field.fail(
        "cuts or pierces and needs axis_mm: its blade's edge or its needle, from the tip to the "
        "upper end, or from the tips of scissors to their pivot, of 0.1 mm at least");
  if (has_blade(instrument.mode)) {
    read_blade(field, instrument);
  } else if (const auto width = field.find("cut_width_mm")) {
    width->fail("is for instruments that cut or snip alone");
  }
  const bool scissors = instrument.mode == InstrumentMode::snip;
  if (const auto along = field.find("opens_along"); along && !scissors)
    along->fail("is for instruments that snip alone");
  if (const auto shaft = field.find("shaft")) instrument.shaft = direction_from(*shaft);
  const JsonField path = field["path"];
  if (path.size() == 0) path.fail("must hold a waypoint");
  for (std::size_t i = 0; i < path.size(); ++i) {
    instrument.path.push_back(waypoint_from(path.at(i)));
    if (i > 0 && instrument.path[i].time_s <= instrument.path[i - 1].time_s) {
      path.at(i)["time_s"].fail("must be later than the waypoint's before");
    }
    if (instrument.path[i].opening_mm > 0 && !scissors)
      path.at(i)["opening_mm"].fail("is for instruments that snip alone");
  }
  return instrument;
}

DrawnLight light_from(const JsonField& field) {
  if (const auto light = drawn_light(field.text())) return *light;
  field.fail("is no light: take baked, world or scope");
}

TissueSolver solver_from(const JsonField& field) {
  if (const auto solver = tissue_solver(field.text())) return *solver;
  field.fail("must be springs or fem");
}

}  // namespace

Script script_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  document.require_schema(kSchema);
  document.allow_only({"schema", "name", "time_step_s", "frames", "size", "solver", "light",
                       "camera", "instruments"});
  Script script;
  script.name = document["name"].text();
  script.time_step_s = document["time_step_s"].number(1e-5, 0.1);
  script.frames = static_cast<int>(document["frames"].integer(1, kMostScriptFrames));
  if (const auto size = document.find("size")) {
    if (size->size() != 2) size->fail("must hold two numbers, width and height");
    script.width = static_cast<int>(size->at(0).integer(1, kLargestSide_px));
    script.height = static_cast<int>(size->at(1).integer(1, kLargestSide_px));
  }
  if (const auto solver = document.find("solver")) script.solver = solver_from(*solver);
  if (const auto light = document.find("light")) script.light = light_from(*light);
  read_script_camera(document["camera"], name, script);
  const JsonField instruments = document["instruments"];
  if (instruments.size() > kMostTips)
    instruments.fail("may hold " + std::to_string(kMostTips) + " instruments at most");
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    script.instruments.push_back(instrument_from(instruments.at(i)));
  }
  return script;
}

Script read_script(const std::filesystem::path& path) {
  return script_from_json(read_text_file(path), path.string());
}

double catmull_rom(double before, double a, double b, double after, double t) {
  return a + 0.5 * t *
                 (b - before +
                  t * (2 * before - 5 * a + 4 * b - after + t * (3 * (a - b) + after - before)));
}

KeyframeStretch keyframes_at(const Script& script, int frame) {
  const auto& keys = script.camera;
  const int count = static_cast<int>(keys.size());
  const auto next = std::find_if(keys.begin(), keys.end(),
                                 [&](const CameraKeyframe& k) { return k.frame > frame; });
  const int b = static_cast<int>(next - keys.begin());
  if (b == 0) return {0, 0, 0, 0, 0};
  if (b == count) return {count - 1, count - 1, count - 1, count - 1, 0};
  const int a = b - 1;
  return {std::max(a - 1, 0), a, b, std::min(b + 1, count - 1),
          double(frame - keys[a].frame) / (keys[b].frame - keys[a].frame)};
}

OrbitPose camera_at(const Script& script, int frame) {
  const KeyframeStretch at = keyframes_at(script, frame);
  const auto pose_of = [&](int key) -> const OrbitPose& { return script.camera[key].pose; };
  const OrbitPose &before = pose_of(at.before), &a = pose_of(at.a), &b = pose_of(at.b),
                  &after = pose_of(at.after);
  if (at.a == at.b) return a;
  const auto between = [&](double OrbitPose::*member) {
    return catmull_rom(before.*member, a.*member, b.*member, after.*member, at.share);
  };
  OrbitPose pose{between(&OrbitPose::azimuth_rad), between(&OrbitPose::elevation_rad),
                 between(&OrbitPose::distance),    between(&OrbitPose::roll_rad),
                 between(&OrbitPose::right),       between(&OrbitPose::up)};
  // A spline may overshoot; a viewer must not come closer than any keyframe asks.
  pose.distance = std::max(pose.distance, std::min(a.distance, b.distance));
  return pose;
}

}  // namespace organbake
