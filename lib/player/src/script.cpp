// SPDX-License-Identifier: Apache-2.0
// Writes and reads scripts (interaction.schema.json). Their camera has three forms: key frames on
// an orbit, between which a Catmull-Rom spline leads, key frames of free poses, and one recorded
// camera for each frame. Angles too large for radians are refused as degrees.
#include "organbake/player/script.h"

#include <Eigen/Geometry>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/instruments/instrument_json.h"
#include "organbake/player/skin_point.h"

namespace organbake {
namespace {

constexpr double kFarthestEye_mm = 1e6;

Eigen::Vector3d place_from(const JsonField& field) {
  const Eigen::Vector3d place = field.vector3();
  if (place.norm() > kFarthestEye_mm) field.fail("lies more than a kilometre away");
  return place;
}

// The pose of an eye at one place that looks at another.
RigidTransform looking_from(const JsonField& field) {
  field.allow_only({"frame", "position_mm", "look_at_mm", "up_direction"});
  const Eigen::Vector3d eye = place_from(field["position_mm"]),
                        target = place_from(field["look_at_mm"]);
  constexpr double kNearest_mm = 1e-3;
  if ((target - eye).norm() < kNearest_mm)
    field["look_at_mm"].fail("is where the eye is; a view needs a direction");
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  if (const auto written = field.find("up_direction")) {
    up = written->vector3();
    if (!std::isnormal(up.squaredNorm())) written->fail("must have a length");
  }
  return look_at(eye, target, up.normalized());
}

RigidTransform pose_from(const JsonField& field) {
  field.allow_only({"rotation", "translation_mm"});
  return {field["rotation"].rotation(), place_from(field["translation_mm"])};
}

std::optional<RigidTransform> free_pose_from(const JsonField& keyframe) {
  if (const auto pose = keyframe.find("camera_from_world")) {
    keyframe.allow_only({"frame", "camera_from_world"});
    return pose_from(*pose);
  }
  if (keyframe.find("position_mm") || keyframe.find("look_at_mm")) return looking_from(keyframe);
  return std::nullopt;
}

[[noreturn]] void refuse_as_degrees(const JsonField& angle) {
  angle.fail("is " + to_text(angle.number()) + ": " + kAnglesAreRadians);
}

OrbitPose orbit_from(const JsonField& field) {
  field.allow_only(
      {"frame", "azimuth_rad", "elevation_rad", "distance", "roll_rad", "right", "up"});
  OrbitPose pose;
  pose.azimuth_rad = field["azimuth_rad"].number(-1e3, 1e3);
  pose.elevation_rad = field["elevation_rad"].number(-1e3, 1e3);
  if (!can_be_elevation(pose.elevation_rad)) refuse_as_degrees(field["elevation_rad"]);
  constexpr double kNearest = 1e-3, kFarthest = 1e3;  // multiples of the capture distance
  field.read("distance", kNearest, kFarthest, pose.distance);
  field.read("roll_rad", -1e3, 1e3, pose.roll_rad);
  if (!can_be_azimuth(pose.roll_rad)) refuse_as_degrees(field["roll_rad"]);
  field.read("right", -1e3, 1e3, pose.right);
  field.read("up", -1e3, 1e3, pose.up);
  return pose;
}

CameraKeyframe keyframe_from(const JsonField& field) {
  CameraKeyframe key;
  key.frame = static_cast<int>(field["frame"].integer(0, kMostScriptFrames));
  key.camera_from_world = free_pose_from(field);
  if (!key.camera_from_world) key.pose = orbit_from(field);
  return key;
}

void read_keyframes(const JsonField& keyframes, Script& script) {
  if (keyframes.size() == 0) keyframes.fail("must hold a keyframe");
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    script.camera.push_back(keyframe_from(keyframes.at(i)));
    const CameraKeyframe& key = script.camera.back();
    if (i > 0 && key.frame <= script.camera[i - 1].frame) {
      keyframes.at(i)["frame"].fail("must be later than the keyframe's before");
    }
    if (key.camera_from_world.has_value() != script.camera.front().camera_from_world.has_value())
      keyframes.at(i).fail("mixes an orbit with free poses; write all keyframes in one way");
    if (key.camera_from_world) continue;
    // A long interaction may go round many times, but no more than once to the next keyframe.
    const double from = i > 0 ? script.camera[i - 1].pose.azimuth_rad : 0;
    if (!can_be_azimuth(key.pose.azimuth_rad - from))
      refuse_as_degrees(keyframes.at(i)["azimuth_rad"]);
  }
}

Intrinsics lens_from(const JsonField& field, const Script& script) {
  field.allow_only({"fx", "fy", "cx", "cy"});
  if (script.width == 0) field.fail("needs the script's \"size\", in whose pixels it is given");
  Intrinsics lens;
  lens.width = script.width, lens.height = script.height;
  constexpr double kSmallest = 1e-3, kLargest = 1e9;
  lens.fx = field["fx"].number(kSmallest, kLargest);
  lens.fy = field["fy"].number(kSmallest, kLargest);
  lens.cx = field["cx"].number(-kLargest, kLargest);
  lens.cy = field["cy"].number(-kLargest, kLargest);
  return lens;
}

Json keyframe_json(const CameraKeyframe& key) {
  if (key.camera_from_world)
    return {{"frame", key.frame}, {"camera_from_world", to_json(*key.camera_from_world)}};
  return {{"frame", key.frame},
          {"azimuth_rad", key.pose.azimuth_rad},
          {"elevation_rad", key.pose.elevation_rad},
          {"distance", key.pose.distance},
          {"roll_rad", key.pose.roll_rad},
          {"right", key.pose.right},
          {"up", key.pose.up}};
}

// The keyframes before and behind a frame, and theirs; before the first and after the last a and b
// are the same.
struct KeyframeSpan {
  int before, a, b, after;
  double share;  // of the way from a to b
};

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

double catmull_rom(double before, double a, double b, double after, double t) {
  return a + 0.5 * t *
                 (b - before +
                  t * (2 * before - 5 * a + 4 * b - after + t * (3 * (a - b) + after - before)));
}

RigidTransform free_pose_at(const Script& script, int frame) {
  const KeyframeSpan at = keyframes_at(script, frame);
  const auto pose = [&](int key) { return *script.camera[key].camera_from_world; };
  if (at.a == at.b) return pose(at.a);
  const Eigen::Quaterniond from(pose(at.a).rotation), to(pose(at.b).rotation);
  const auto eye = [&](int key) -> Eigen::Vector3d { return pose(key).inverse().translation; };
  Eigen::Vector3d center;
  for (int k = 0; k < 3; ++k)
    center[k] =
        catmull_rom(eye(at.before)[k], eye(at.a)[k], eye(at.b)[k], eye(at.after)[k], at.share);
  const Eigen::Matrix3d rotation = from.slerp(at.share, to).toRotationMatrix();
  return {rotation, -(rotation * center)};
}

// A script's "camera": keyframes on an orbit or free ones, with intrinsics of its own, or a
// recorded sequence of cameras.json, one camera a frame. Free keyframes move on a Catmull–Rom curve
// and turn by slerp. `name` is the script's file: a recorded sequence lies relative to it. The
// script's size and frames have been read. Throws BadDataError naming the key.
void read_script_camera(const JsonField& camera, const std::string& name, Script& script) {
  camera.allow_only({"keyframes", "intrinsics", "recorded"});
  if (const auto recorded = camera.find("recorded")) {
    camera.allow_only({"recorded"});
    script.recorded_file = recorded->text();
    const auto file = std::filesystem::path(name).parent_path() / script.recorded_file;
    return take_recorded(read_cameras(file), file.string(), script);
  }
  read_keyframes(camera["keyframes"], script);
  if (const auto lens = camera.find("intrinsics")) script.lens = lens_from(*lens, script);
}

Json script_camera_json(const Script& script) {
  if (!script.recorded_file.empty()) return {{"recorded", script.recorded_file}};
  Json keyframes = Json::array();
  for (const CameraKeyframe& key : script.camera) keyframes.push_back(keyframe_json(key));
  Json json = {{"keyframes", keyframes}};
  if (script.lens)
    json["intrinsics"] = {{"fx", script.lens->fx},
                          {"fy", script.lens->fy},
                          {"cx", script.lens->cx},
                          {"cy", script.lens->cy}};
  return json;
}

}  // namespace

void take_recorded(const CameraSet& cameras, const std::string& name, Script& script) {
  const auto& all = cameras.cameras;
  if (all.size() < std::size_t(script.frames))
    throw UsageError(name + ": holds " + std::to_string(all.size()) + " cameras for " +
                     std::to_string(script.frames) + " frames; each frame needs its own");
  const Intrinsics& first = all.front().intrinsics;
  for (const PosedCamera& camera : all) {
    const Intrinsics& lens = camera.intrinsics;
    if (lens.has_distortion())
      throw UsageError(name + ": camera '" + camera.name +
                       "' has lens distortion; frames are drawn without, so take its intrinsics "
                       "of the undistorted pictures, or put it on with --scope");
    if (lens.width != first.width || lens.height != first.height)
      throw UsageError(name + ": camera '" + camera.name +
                       "' is of another size than the first; the frames of a sequence have one");
  }
  if (script.width == 0) script.width = first.width, script.height = first.height;
  script.recorded = all;
}

View view_of(const PosedCamera& camera, int width, int height) {
  View view;
  view.camera = camera;
  Intrinsics& lens = view.camera.intrinsics;
  const double across = double(width) / lens.width, down = double(height) / lens.height;
  lens.fx *= across, lens.cx *= across, lens.fy *= down, lens.cy *= down;
  lens.width = width, lens.height = height;
  return view;
}

View view_at(const Script& script, int frame, const CameraSet& cameras, int width, int height) {
  if (!script.recorded.empty()) {
    const std::size_t last = script.recorded.size() - 1;
    return view_of(script.recorded[std::min(std::size_t(frame), last)], width, height);
  }
  View view = script.camera.front().camera_from_world
                  ? orbit_view(cameras, {}, width, height)
                  : orbit_view(cameras, camera_at(script, frame), width, height);
  if (script.camera.front().camera_from_world)
    view.camera.camera_from_world = free_pose_at(script, frame);
  if (!script.lens) return view;
  PosedCamera own = view.camera;
  own.intrinsics = *script.lens;
  return view_of(own, width, height);
}

namespace {

constexpr const char* kSchema = "organbake/interaction/1";

DrawnLight light_from(const JsonField& field) {
  if (const auto light = drawn_light(field.text())) return *light;
  field.fail("is no light: take " + all_lights());
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

std::vector<std::vector<double>> states_from(const JsonField& field) {
  std::vector<std::vector<double>> states(field.size());
  if (states.empty()) field.fail("must hold a state");
  for (std::size_t i = 0; i < states.size(); ++i) {
    const JsonField state = field.at(i);
    for (std::size_t k = 0; k < state.size(); ++k) states[i].push_back(state.at(k).number());
    if (state.size() % 3 != 0 || state.size() != states[0].size())
      state.fail("must hold x, y and z of each vertex, of as many as the first state");
  }
  return states;
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
                       "cuts_part_in", "camera", "instruments", "vertices_mm"});
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
  if (const auto states = document.find("vertices_mm")) script.vertices_mm = states_from(*states);
  if (!script.vertices_mm.empty() && !script.instruments.empty())
    instruments.fail("must be empty beside \"vertices_mm\": such tissue gives way to no tool");
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
  if (!script.vertices_mm.empty()) json["vertices_mm"] = script.vertices_mm;
  if (script.light) json["light"] = to_string(*script.light);
  return json_text(json);
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

// Depths below the skin become places, by the skin of the organ at rest.
namespace {

// The ball's foremost point, not its centre, is at the depth. The tool comes from the side that the
// skin faces, unless its axis, shaft or trocar tells from where.
Eigen::Vector3d tip_at_depth(const Waypoint& waypoint, const InstrumentPath& path,
                             const Bundle& bundle) {
  const bool told = !path.instrument.axis_mm.isZero(0) || path.shaft || path.trocar_mm;
  const Eigen::Vector3d along = waypoint.direction.normalized();
  const auto [skin_mm, from_behind] = skin_place(bundle, along);
  const double side = from_behind && !told ? -1 : 1;
  return skin_mm + side * (path.instrument.radius_mm - waypoint.depth_mm) * along;
}

// Where a script's direction stands, before what is wrong with it.
std::string place_of(const Script& script, std::size_t instrument, std::size_t waypoint) {
  return "script '" + script.name + "': /instruments/" + std::to_string(instrument) + "/path/" +
         std::to_string(waypoint) + "/direction: ";
}

}  // namespace

InstrumentMotion::InstrumentMotion(const Script& script, const Bundle& bundle)
    : paths_(script.instruments) {
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    double& radius_mm = paths_[i].instrument.radius_mm;
    if (!(radius_mm > 0)) radius_mm = bundle.mechanics.instrument_radius_mm;
    for (std::size_t w = 0; w < paths_[i].path.size(); ++w) {
      Waypoint& waypoint = paths_[i].path[w];
      if (waypoint.position_mm) continue;
      try {
        waypoint.position_mm = tip_at_depth(waypoint, paths_[i], bundle);
      } catch (const BadDataError& error) {
        throw BadDataError(place_of(script, i, w) + error.what());
      }
    }
  }
}

std::vector<Instrument> InstrumentMotion::at(double time_s) const {
  std::vector<Instrument> instruments;
  for (const InstrumentPath& path : paths_) instruments.push_back(path.at(time_s));
  return instruments;
}

}  // namespace organbake
