// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/foreign_cameras.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/error.h"
#include "formats/camera_files.h"
#include "geometry/camera.h"
#include "geometry/written_rotation.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

// OpenGL's camera looks along −z with y up, ours along +z with y down.
const Eigen::DiagonalMatrix<double, 3> kAxes(1, -1, -1);

double value(const Json& frame, const Json& top, const char* key, double otherwise) {
  const Json& where = frame.contains(key) ? frame : top;
  return where.contains(key) && where[key].is_number() ? where[key].get<double>() : otherwise;
}

Intrinsics lens_from(const Json& frame, const Json& top) {
  Intrinsics k;
  k.width = written_size(value(frame, top, "w", 0));
  k.height = written_size(value(frame, top, "h", 0));
  const double angle = value(frame, top, "camera_angle_x", 0);
  const double from_angle = angle > 0 ? k.width / (2 * std::tan(angle / 2)) : 0;
  k.fx = value(frame, top, "fl_x", from_angle);
  k.fy = value(frame, top, "fl_y", k.fx);
  k.cx = value(frame, top, "cx", k.width / 2.0);
  k.cy = value(frame, top, "cy", k.height / 2.0);
  k.k1 = value(frame, top, "k1", 0);
  k.k2 = value(frame, top, "k2", 0);
  k.p1 = value(frame, top, "p1", 0);
  k.p2 = value(frame, top, "p2", 0);
  k.k3 = value(frame, top, "k3", 0);
  return k;
}

// Lenses whose k1, k2 … mean something else (nerfstudio and instant-ngp name them).
void check_model(const Json& json, const fs::path& path) {
  const auto model = json.find("camera_model");
  if (model != json.end() && model->is_string()) {
    const auto name = model->get<std::string>();
    if (name != "OPENCV" && name != "PINHOLE" && name != "SIMPLE_PINHOLE" && name != "RADIAL" &&
        name != "SIMPLE_RADIAL" && name != "PERSPECTIVE")
      throw BadDataError(path, "is of the lens model \"" + name +
                                   "\"; only OPENCV with k1 k2 p1 p2 k3 and PINHOLE are read");
  }
  const auto fisheye = json.find("is_fisheye");
  if (fisheye != json.end() && *fisheye == true)
    throw BadDataError(path, "is of a fisheye; only OPENCV and PINHOLE lenses are read");
  for (const char* more : {"k4", "k5", "k6"})
    if (value(json, json, more, 0) != 0)
      throw BadDataError(path, std::string("its distortion ") + more + " is not supported");
}

// Nothing for what is no rigid motion.
std::optional<RigidTransform> pose_from(const Json& matrix) {
  RigidTransform world_from_camera;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      world_from_camera.rotation(row, column) = matrix.at(row).at(column).get<double>();
    world_from_camera.translation[row] = matrix.at(row).at(3).get<double>();
  }
  const auto rotation = written_rotation(world_from_camera.rotation);
  if (!rotation) return std::nullopt;
  world_from_camera.rotation = *rotation * kAxes;
  return world_from_camera.inverse();
}

Json list(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json bounds_and_units(const SceneFacts& facts) {
  return {{"units", "mm"},
          {"axes", "LPS: x left, y posterior, z superior"},
          {"bounds_mm", {list(facts.bounds_mm.min), list(facts.bounds_mm.max)}},
          {"depth_unit_mm", facts.depth_unit_mm},
          {"depth", "planar z in counts of depth_unit_mm, 0 = nothing there"}};
}

// instant-ngp trains in the unit cube: position · scale + offset, before it turns the axes round,
// which a cube's centre does not mind.
void add_facts(Json& json, const SceneFacts& facts) {
  constexpr double kShareOfCube = 0.9;
  const Eigen::Vector3d size_mm = facts.bounds_mm.max - facts.bounds_mm.min;
  const double scale = kShareOfCube / size_mm.maxCoeff();
  const Eigen::Vector3d offset = Eigen::Vector3d::Constant(0.5) - scale * facts.bounds_mm.center();
  json["scale"] = scale;
  json["offset"] = list(offset);
  json["aabb_scale"] = 1;
  json["enable_depth_loading"] = true;
  json["integer_depth_scale"] = facts.depth_unit_mm;
  json["ply_file_path"] = facts.points;
  json.update(bounds_and_units(facts));
}

}  // namespace

CameraSet transforms_from_json(const Json& json, const fs::path& path) {
  CameraSet set;
  check_model(json, path);
  try {
    for (const Json& frame : json.at("frames")) {
      check_model(frame, path);
      PosedCamera camera;
      camera.name = frame.at("file_path").get<std::string>();
      camera.intrinsics = lens_from(frame, json);
      const auto pose = pose_from(frame.at("transform_matrix"));
      if (!pose)
        throw BadDataError(path, camera.name + ": its transform_matrix is no rigid motion");
      camera.camera_from_world = *pose;
      camera.intrinsics.check();
      set.images.push_back(camera.name);
      set.cameras.push_back(camera);
    }
  } catch (const Json::exception& error) {
    throw BadDataError(path, std::string("is no transforms.json: ") + error.what());
  }
  return set;
}

std::string transforms_json(const CameraSet& set, const SceneFacts& facts) {
  Json frames = Json::array();
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    const Intrinsics& k = set.cameras[i].intrinsics;
    const RigidTransform world_from_camera = set.cameras[i].camera_from_world.inverse();
    const Eigen::Matrix3d rotation = world_from_camera.rotation * kAxes;
    Json matrix = Json::array();
    for (int row = 0; row < 3; ++row)
      matrix.push_back({rotation(row, 0), rotation(row, 1), rotation(row, 2),
                        world_from_camera.translation[row]});
    matrix.push_back({0, 0, 0, 1});
    frames.push_back({{"file_path", set.images.empty() ? set.cameras[i].name : set.images[i]},
                      {"w", k.width},
                      {"h", k.height},
                      {"fl_x", k.fx},
                      {"fl_y", k.fy},
                      {"cx", k.cx},
                      {"cy", k.cy},
                      {"k1", k.k1},
                      {"k2", k.k2},
                      {"p1", k.p1},
                      {"p2", k.p2},
                      {"k3", k.k3},
                      {"transform_matrix", matrix}});
    if (!facts.depths.empty()) {
      frames.back()["depth_path"] = facts.depths[i];
      frames.back()["depth_file_path"] = facts.depths[i];
    }
  }
  Json json = {{"camera_model", "OPENCV"}};
  if (facts.depth_unit_mm > 0) add_facts(json, facts);
  json["frames"] = frames;
  return json.dump(2) + "\n";
}

std::string scene_json(const SceneFacts& facts) {
  Json json = bounds_and_units(facts);
  json["points"] = facts.points;
  return json.dump(2) + "\n";
}

}  // namespace organbake
