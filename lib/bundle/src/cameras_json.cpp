// SPDX-License-Identifier: Apache-2.0
// Writes and reads cameras.json: lenses, poses and the viewing projection manifold. What is read is
// checked for what later code takes for granted: proper rotations, unit directions, and triangles
// of cameras that exist.
#include "organbake/bundle/cameras_json.h"

#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

constexpr const char* kSchema = "organbake/cameras/1";
constexpr std::size_t kMostCameras = 100000;  // as many as a script has frames

Json camera_to_json(const PosedCamera& camera) {
  Json json = {{"name", camera.name}};
  json.update(intrinsics_to_json(camera.intrinsics));
  json["camera_from_world"] = to_json(camera.camera_from_world);
  return json;
}

PosedCamera camera_from(const JsonField& field) {
  PosedCamera camera;
  camera.name = field["name"].text();
  camera.intrinsics = intrinsics_from_json(field, kLargestPhotoSide_px);
  const JsonField pose = field["camera_from_world"];
  camera.camera_from_world = {pose["rotation"].rotation(), pose["translation_mm"].vector3()};
  return camera;
}

Json manifold_to_json(const ViewManifold& manifold) {
  Json directions = Json::array(), triangles = Json::array();
  for (const auto& d : manifold.directions) directions.push_back(to_json(d));
  for (const auto& t : manifold.triangles) triangles.push_back(Json::array({t[0], t[1], t[2]}));
  return {{"center_mm", to_json(manifold.center_world_mm)},
          {"directions", directions},
          {"triangles", triangles}};
}

ViewManifold manifold_from(const JsonField& field, std::size_t camera_count) {
  ViewManifold manifold;
  manifold.center_world_mm = field["center_mm"].vector3();
  const JsonField directions = field["directions"];
  if (directions.size() != camera_count) directions.fail("must hold one direction per camera");
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Eigen::Vector3d d = directions.at(i).vector3();
    constexpr double kUnit = 1e-6;
    if (std::abs(d.norm() - 1) > kUnit) directions.at(i).fail("must have length 1");
    manifold.directions.push_back(d);
  }
  const JsonField triangles = field["triangles"];
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const JsonField triangle = triangles.at(i);
    if (triangle.size() != 3) triangle.fail("must hold three cameras");
    std::array<std::uint32_t, 3> corners{};
    for (int c = 0; c < 3; ++c) {
      corners[c] = static_cast<std::uint32_t>(
          triangle.at(c).integer(0, static_cast<std::int64_t>(camera_count) - 1));
    }
    manifold.triangles.push_back(corners);
  }
  return manifold;
}

}  // namespace

std::string cameras_to_json(const CameraSet& set) {
  Json cameras = Json::array();
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    cameras.push_back(camera_to_json(set.cameras[i]));
    if (!set.images.empty()) cameras.back()["image"] = set.images.at(i);
  }
  Json json = {{"schema", kSchema}, {"cameras", cameras}};
  if (!set.manifold.directions.empty()) {
    json["viewing_projection_manifold"] = manifold_to_json(set.manifold);
  }
  return json_text(json);
}

CameraSet cameras_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  document.require_schema(kSchema);
  const JsonField cameras = document["cameras"];
  if (cameras.size() > kMostCameras) {
    cameras.fail("holds " + std::to_string(cameras.size()) + " cameras; at most " +
                 std::to_string(kMostCameras) + " are read");
  }
  CameraSet set;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    set.cameras.push_back(camera_from(cameras.at(i)));
    if (const auto image = cameras.at(i).find("image")) set.images.push_back(image->text());
  }
  if (!set.images.empty() && set.images.size() != set.cameras.size()) {
    cameras.fail("either every camera names an image or none does");
  }
  if (const auto manifold = document.find("viewing_projection_manifold")) {
    set.manifold = manifold_from(*manifold, set.cameras.size());
  }
  return set;
}

CameraSet read_cameras(const std::filesystem::path& path) {
  return cameras_from_json(read_text_file(path), path.string());
}

}  // namespace organbake
