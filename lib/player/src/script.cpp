// SPDX-License-Identifier: Apache-2.0
// Writes and reads scripts (interaction.schema.json), and the orbit's camera between key frames by
// a Catmull–Rom spline.
#include "organbake/player/script.h"

#include <algorithm>
#include <cmath>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/instruments/instrument_json.h"
#include "organbake/warp/view.h"
#include "script_camera_json.h"

namespace organbake {
namespace {

constexpr const char* kSchema = "organbake/interaction/1";

DrawnLight light_from(const JsonField& field) {
  if (const auto light = drawn_light(field.text())) return *light;
  field.fail("is no light: take baked, world or scope");
}

std::vector<std::uint32_t> frames_from(const JsonField& field) {
  std::vector<std::uint32_t> frames;
  std::int64_t least = 0;
  for (std::size_t i = 0; i < field.size(); ++i) {
    frames.push_back(static_cast<std::uint32_t>(field.at(i).integer(least, kMostScriptFrames)));
    least = frames.back() + 1;
  }
  return frames;
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
                       "cuts_part_in", "camera", "instruments"});
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
  if (const auto frames = document.find("cuts_part_in")) script.cuts_part_in = frames_from(*frames);
  read_script_camera(document["camera"], name, script);
  const JsonField instruments = document["instruments"];
  if (instruments.size() > kMostInstruments)
    instruments.fail("may hold " + std::to_string(kMostInstruments) + " instruments at most");
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    script.instruments.push_back(instrument_from_json(instruments.at(i)));
  }
  return script;
}

Script read_script(const std::filesystem::path& path) {
  return script_from_json(read_text_file(path), path.string());
}

std::string script_to_json(const Script& script) {
  Json instruments = Json::array();
  for (const InstrumentPath& i : script.instruments) instruments.push_back(to_json(i));
  Json json = {{"schema", kSchema},
               {"name", script.name},
               {"time_step_s", script.time_step_s},
               {"frames", script.frames},
               {"camera", script_camera_json(script)},
               {"instruments", instruments}};
  if (script.width > 0 && script.height > 0) json["size"] = {script.width, script.height};
  if (script.solver) json["solver"] = to_string(*script.solver);
  if (script.cuts_part_in) json["cuts_part_in"] = *script.cuts_part_in;
  if (script.light) json["light"] = to_string(*script.light);
  return json_text(json);
}

double catmull_rom(double before, double a, double b, double after, double t) {
  return a + 0.5 * t *
                 (b - before +
                  t * (2 * before - 5 * a + 4 * b - after + t * (3 * (a - b) + after - before)));
}

KeyframeSpan keyframes_at(const Script& script, int frame) {
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
  const KeyframeSpan at = keyframes_at(script, frame);
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
