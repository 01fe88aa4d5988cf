// SPDX-License-Identifier: GPL-3.0-or-later
#include "cameras/transforms_json.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/photo.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

// OpenGL's camera looks along −z with y up, ours along +z with y down.
const Eigen::DiagonalMatrix<double, 3> kAxes(1, -1, -1);

// Of the frame, else of the top. Throws BadDataError for what is there and is no finite number.
double value(const Json& frame, const Json& top, const char* key, double otherwise,
             const fs::path& path) {
  const Json& where = frame.contains(key) ? frame : top;
  if (!where.contains(key)) return otherwise;
  if (!where[key].is_number() || !std::isfinite(where[key].get<double>()))
    throw BadDataError(path, std::string("its '") + key + "' is no number");
  return where[key].get<double>();
}

// The models whose k1, k2 … are ours (nerfstudio and instant-ngp name them).
LensModel model_of(const Json& frame, const Json& top, const fs::path& path) {
  const Json& where = frame.contains("camera_model") ? frame : top;
  const auto model = where.find("camera_model");
  std::string name = model != where.end() && model->is_string() ? model->get<std::string>() : "";
  for (const Json* json : {&frame, &top})
    if (json->contains("is_fisheye") && (*json)["is_fisheye"] == true) name = "OPENCV_FISHEYE";
  if (name == "OPENCV_FISHEYE") return LensModel::fisheye;
  for (const char* known :
       {"", "OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "RADIAL", "SIMPLE_RADIAL", "PERSPECTIVE"})
    if (name == known) return LensModel::brown;
  throw BadDataError(path, "is of the lens model \"" + name +
                               "\"; only OPENCV with k1 k2 p1 p2 k3, OPENCV_FISHEYE with k1 k2 k3 "
                               "k4, and PINHOLE are read");
}

void read_distortion(const Json& frame, const Json& top, const fs::path& path, Intrinsics& k) {
  const auto number = [&](const char* key) { return value(frame, top, key, 0, path); };
  k.model = model_of(frame, top, path);
  k.k1 = number("k1");
  k.k2 = number("k2");
  k.k3 = number("k3");
  const bool fisheye = k.model == LensModel::fisheye;
  (fisheye ? k.k4 : k.p1) = number(fisheye ? "k4" : "p1");
  if (!fisheye) k.p2 = number("p2");
  for (const char* more : {"k4", "k5", "k6"})
    if (number(more) != 0 && !(fisheye && std::string(more) == "k4"))
      throw BadDataError(path, std::string("its distortion ") + more + " is not supported");
}

Intrinsics lens_from(const Json& frame, const Json& top, const fs::path& path,
                     const PictureSides& picture) {
  const auto number = [&](const char* key, double otherwise) {
    return value(frame, top, key, otherwise, path);
  };
  Intrinsics k;
  k.width = written_size(number("w", picture.width));
  k.height = written_size(number("h", picture.height));
  const double angle = number("camera_angle_x", 0);
  const double from_angle = angle > 0 ? k.width / (2 * std::tan(angle / 2)) : 0;
  k.fx = number("fl_x", from_angle);
  k.fy = number("fl_y", k.fx);
  k.cx = number("cx", k.width / 2.0);
  k.cy = number("cy", k.height / 2.0);
  read_distortion(frame, top, path, k);
  return k;
}

// Of the first frame's picture: all are of one size. Its name may lack the ending.
PictureSides sides_of_first(const Json& frames, const fs::path& path) {
  const fs::path image = path.parent_path() / frames.at(0).at("file_path").get<std::string>();
  for (const char* ending : {"", ".png", ".jpg", ".jpeg"}) {
    const fs::path file = image.string() + ending;
    if (!fs::is_regular_file(file)) continue;
    const Rgb8Image picture = read_photo(file);
    return {picture.width, picture.height};
  }
  throw BadDataError(path, "tells no size of its pictures (w and h), and '" + image.string() +
                               "' is not there to look at");
}

bool tells_size(const Json& json) {
  const Json& frame = json.at("frames").at(0);
  return (json.contains("w") || frame.contains("w")) && (json.contains("h") || frame.contains("h"));
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

CameraSet transforms_from_json(const Json& json, const fs::path& path,
                               std::optional<PictureSides> picture) {
  CameraSet set;
  try {
    const Json& frames = json.at("frames");
    if (!frames.is_array()) throw BadDataError(path, "its 'frames' are no list of cameras");
    if (!picture && !frames.empty() && !tells_size(json)) picture = sides_of_first(frames, path);
    for (const Json& frame : frames) {
      PosedCamera camera;
      camera.name = frame.at("file_path").get<std::string>();
      camera.intrinsics = lens_from(frame, json, path, picture.value_or(PictureSides{}));
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
    if (k.model == LensModel::fisheye) {
      frames.back()["camera_model"] = "OPENCV_FISHEYE";
      frames.back()["k4"] = k.k4;
    }
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
