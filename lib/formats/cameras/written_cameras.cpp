// SPDX-License-Identifier: GPL-3.0-or-later
// Posed cameras, and points of the surface, for other programs: the texts of a COLMAP model (its
// documentation, "Output Format"), and transforms.json with the keys of instant-ngp and nerfstudio.
#include "organbake/formats/camera_files.h"

#include <Eigen/Geometry>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "cameras/camera_formats.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kPlaceDigits = 5, kPixelDigits = 3;

// For each image its X, Y, POINT3D_ID triples, in the order of the points.
std::vector<std::string> sighting_lines(std::size_t images,
                                        const std::vector<SparsePoint>& points) {
  std::vector<std::string> lines(images);
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (const SparsePoint::Sighting& seen : points[p].seen) {
      std::string& line = lines.at(seen.image);
      if (!line.empty()) line += " ";
      line += to_text(seen.pixel.x(), kPixelDigits) + " " + to_text(seen.pixel.y(), kPixelDigits) +
              " " + std::to_string(p + 1);
    }
  }
  return lines;
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

std::string colmap_cameras_text(const CameraSet& set) {
  std::string text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    const Intrinsics& k = set.cameras[i].intrinsics;
    std::vector<double> values = {k.fx, k.fy, k.cx, k.cy};
    const char* model = " PINHOLE ";
    if (k.model == LensModel::fisheye) {
      model = " OPENCV_FISHEYE ";
      values.insert(values.end(), {k.k1, k.k2, k.k3, k.k4});
    } else if (k.has_distortion()) {
      model = " FULL_OPENCV ";
      values.insert(values.end(), {k.k1, k.k2, k.p1, k.p2, k.k3, 0, 0, 0});
    }
    text +=
        std::to_string(i + 1) + model + std::to_string(k.width) + " " + std::to_string(k.height);
    for (const double value : values) text += " " + to_text(value);
    text += "\n";
  }
  return text;
}

std::string colmap_images_text(const CameraSet& set, const std::vector<SparsePoint>& points) {
  const std::vector<std::string> sightings = sighting_lines(set.cameras.size(), points);
  std::string text = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME, then its points\n";
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    const RigidTransform& pose = set.cameras[i].camera_from_world;
    const Eigen::Quaterniond q(pose.rotation);
    text += std::to_string(i + 1);
    for (const double value : {q.w(), q.x(), q.y(), q.z(), pose.translation.x(),
                               pose.translation.y(), pose.translation.z()})
      text += " " + to_text(value);
    const std::string& name = set.images.empty() ? set.cameras[i].name : set.images[i];
    text += " " + std::to_string(i + 1) + " " + name + "\n" + sightings[i] + "\n";
  }
  return text;
}

std::string colmap_points_text(const std::vector<SparsePoint>& points) {
  if (points.empty()) return "# 3D point list: empty\n";
  std::string text =
      "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, then IMAGE_ID and POINT2D_IDX of each "
      "image that shows it\n";
  std::map<std::uint32_t, std::size_t> count;  // sightings so far of each image
  for (std::size_t p = 0; p < points.size(); ++p) {
    const SparsePoint& point = points[p];
    text += std::to_string(p + 1);
    for (int k = 0; k < 3; ++k) text += " " + to_text(point.place_mm[k], kPlaceDigits);
    for (const std::uint8_t channel : point.srgb) text += " " + std::to_string(channel);
    text += " 0";  // the sightings are the point's own projections
    for (const SparsePoint::Sighting& seen : point.seen)
      text += " " + std::to_string(seen.image + 1) + " " + std::to_string(count[seen.image]++);
    text += "\n";
  }
  return text;
}

std::string transforms_json(const CameraSet& set, const SceneFacts& facts) {
  Json frames = Json::array();
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    const Intrinsics& k = set.cameras[i].intrinsics;
    const RigidTransform world_from_camera = set.cameras[i].camera_from_world.inverse();
    const Eigen::Matrix3d rotation = world_from_camera.rotation * kOpenGlAxes;
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

std::string point_cloud_ply(const std::vector<SparsePoint>& points) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\ncomment millimetres, LPS\nelement vertex " +
      std::to_string(points.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nend_header\n";
  for (const SparsePoint& point : points) {
    char place[3 * sizeof(float)];
    const Eigen::Vector3f rounded = point.place_mm.cast<float>();
    std::memcpy(place, rounded.data(), sizeof place);
    bytes.append(place, sizeof place);
    for (const std::uint8_t channel : point.srgb) bytes += static_cast<char>(channel);
  }
  return bytes;
}

}  // namespace organbake
