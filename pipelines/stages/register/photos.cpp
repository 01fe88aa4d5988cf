// SPDX-License-Identifier: GPL-3.0-or-later
// A photograph on its way into registration: freed of its lens's distortion, with the depth that
// belongs to it; and poses as documents.
#include "stages/register/registering.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/lens_files.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/image/exr.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {

Intrinsics lens_of_photo(const std::filesystem::path& file, const std::string& name,
                         const Rgb8Image& image, const RunContext& context) {
  const Intrinsics lens = read_intrinsics(file, name, image.width, image.height);
  check_lens_of_picture(lens, image.width, image.height, file);
  if (const std::string told = told_of_fisheye(lens); !told.empty()) context.info(told);
  return lens;
}

PhotoToRegister straight_photo(PhotoToRegister photo) {
  const Intrinsics lens = photo.intrinsics;
  if (lens.model != LensModel::fisheye) return photo;
  photo.intrinsics = pinhole_of(lens);
  if (photo.mask.width == 0) {
    photo.mask = Rgb8Image(lens.width, lens.height);
    std::fill(photo.mask.pixels.begin(), photo.mask.pixels.end(), std::uint8_t{255});
  }
  // Of another size than the lens they are left for register_photo() to refuse.
  const auto straight = [&](Rgb8Image& picture) {
    if (picture.width == lens.width && picture.height == lens.height)
      picture = undistorted(picture, lens, photo.intrinsics);
  };
  straight(photo.image);
  straight(photo.mask);
  for (PointPair& pair : photo.pairs)
    pair.pixel = project(photo.intrinsics, unproject(lens, pair.pixel));
  return photo;
}

PosedCamera camera_as_taken(const RegisteredPhoto& registered, const Intrinsics& lens) {
  if (lens.model != LensModel::fisheye) return registered.camera;
  PosedCamera camera = registered.camera;
  const double focal_scale = camera.intrinsics.fx / pinhole_of(lens).fx;
  camera.intrinsics = lens;
  camera.intrinsics.fx *= focal_scale;
  camera.intrinsics.fy *= focal_scale;
  return camera;
}

namespace {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Vector3d;

std::string degrees(double rad) { return to_text(rad * 180 / M_PI, 0) + "°"; }

// The map's own lens; the photograph's at the map's size where it has none, or only an assumed one.
Intrinsics lens_of_map(const fs::path& path, const DepthMap& map, const Intrinsics& photo) {
  const int width = map.depth.width, height = map.depth.height;
  if (map.facts.camera && !map.has_note(kLensNote, kAssumedLens))
    return map.facts.camera->intrinsics;
  if (is_scaled_picture(photo, width, height)) return scaled_lens(pinhole_of(photo), width, height);
  throw BadDataError(path, "is " + std::to_string(width) + "x" + std::to_string(height) +
                               " and says no camera; the photograph is " +
                               std::to_string(photo.width) + "x" + std::to_string(photo.height) +
                               ": give a map of the photograph, of its size or smaller");
}

// Straightened and rectified pictures show a little more or less than what was taken.
void check_same_view(const fs::path& path, const Intrinsics& map, const Intrinsics& photo) {
  constexpr double kMost = 1.35;
  const double a = angle_across_rad(map), b = angle_across_rad(photo);
  if (std::max(a, b) > kMost * std::min(a, b))
    throw BadDataError(path, "was made with a lens of " + degrees(a) +
                                 " across, the photograph's has " + degrees(b) +
                                 ": they are not one camera's");
}

bool same_picture(const Intrinsics& map, const Intrinsics& photo) {
  constexpr double kSevenDigits = 1e-4;
  if (photo.has_distortion() || !is_scaled_picture(photo, map.width, map.height)) return false;
  const Intrinsics small = scaled_lens(photo, map.width, map.height);
  return std::abs(map.fx / small.fx - 1) < kSevenDigits &&
         std::abs(map.cx - small.cx) < kSevenDigits * map.width &&
         std::abs(map.cy - small.cy) < kSevenDigits * map.height;
}

Matrix3d photo_from_map(const DepthMap& map, const Intrinsics& lens, const Intrinsics& photo) {
  if (!map.facts.camera || !map.has_note(kWorldNote, kScopesOwnAxes) || same_picture(lens, photo))
    return Matrix3d::Identity();
  const auto turn = written_rotation(map.facts.camera->camera_from_world.rotation);
  return turn ? Matrix3d(turn->transpose()) : Matrix3d::Identity();
}

void check_lengths(const fs::path& path, const DepthPoints& points) {
  constexpr double kNearest_mm = 2, kFarthest_mm = 2000;
  if (points.places.empty()) throw BadDataError(path, "holds no depth at all");
  if (points.relative) return;
  std::vector<double> depths;
  for (const Vector3d& place : points.places) depths.push_back(place.z());
  const double usual = median(std::move(depths));
  if (usual < kNearest_mm || usual > kFarthest_mm)
    throw BadDataError(path, "has depths about " + to_text(usual, 3) +
                                 ", which no scope sees in mm; are they in another unit?");
}

// The maps are named as their frames.
const DepthFile* map_of(const std::vector<DepthFile>& files, const std::string& photo) {
  if (files.size() == 1) return &files.front();
  const auto named = std::find_if(files.begin(), files.end(), [&](const DepthFile& file) {
    return file.depth.stem() == fs::path(photo).stem();
  });
  return named == files.end() ? nullptr : &*named;
}

// Points of a surface that the photograph's camera can see.
DepthPoints seen_of_surface(const fs::path& path, const std::string& photo) {
  TriangleMesh mesh = read_mesh(path);
  const fs::path beside = path.parent_path() / "cameras.json";
  if (fs::is_regular_file(beside)) {
    const CameraSet set = read_cameras(beside);
    auto at = camera_with_image(set, photo);
    for (std::size_t i = 0; i < set.cameras.size() && !at; ++i)
      if (set.cameras[i].name == fs::path(photo).stem()) at = i;
    if (at)
      for (Vector3d& vertex : mesh.vertices) vertex = set.cameras[*at].camera_from_world * vertex;
  }
  constexpr double kAlmost = 0.995;  // of the way: not the vertex's own faces
  std::vector<Ray> rays;
  for (const Vector3d& vertex : mesh.vertices)
    rays.push_back({Vector3d::Zero(), vertex, 0, kAlmost});
  std::vector<std::uint8_t> hidden(rays.size());
  RayScene(mesh).occluded(rays, hidden);
  DepthPoints points;
  for (std::size_t i = 0; i < hidden.size(); ++i)
    if (!hidden[i] && mesh.vertices[i].z() > 0) points.places.push_back(mesh.vertices[i]);
  check_lengths(path, points);
  return points;
}

}  // namespace

DepthPoints read_depth_points(const DepthFile& file, const Intrinsics& lens,
                              const RunContext& context) {
  const DepthMap map = read_depth_map(file.depth, context);
  const Intrinsics own = lens_of_map(file.depth, map, lens);
  check_same_view(file.depth, own, lens);
  const Matrix3d turn = photo_from_map(map, own, lens);
  Plane confidence;
  if (file.confidence) confidence = read_confidence(*file.confidence);
  const bool trusted = confidence.width == map.depth.width && confidence.height == map.depth.height;
  DepthPoints points;
  points.relative = map.has_note(kDepthUnitNote, kRelativeDepth);
  for (int y = 0; y < map.depth.height; ++y)
    for (int x = 0; x < map.depth.width; ++x) {
      const float z = map.depth.at(x, y);
      if (!std::isfinite(z) || !(z > 0)) continue;
      points.places.push_back(turn * (z * unproject(own, {x + 0.5, y + 0.5})));
      if (trusted) points.trust.push_back(confidence.at(x, y));
    }
  check_lengths(file.depth, points);
  return points;
}

SeenDepth read_seen_depth(const fs::path& given, const std::string& photo, const Intrinsics& lens,
                          const RunContext& context) {
  DepthPoints points;
  if (fs::is_directory(given)) {
    const std::vector<DepthFile> files = depth_files_in(given);
    const DepthFile* file = map_of(files, photo);
    if (!file) {
      context.warn("none of the " + std::to_string(files.size()) + " depth maps of " +
                   given.string() + " is named as " + photo + ": its pose is told without depth");
      return {};
    }
    points = read_depth_points(*file, lens, context);
  } else if (lower_ending(given) == ".exr") {
    points = read_depth_points({given, {}, {}}, lens, context);
  } else {
    points = seen_of_surface(given, photo);
  }
  return thin_depth(points.places, points.trust, points.relative);
}

namespace {

using Json = nlohmann::ordered_json;

Json verdict_json(const RegisteredPhoto& registered) {
  const PoseQuality& q = registered.quality;
  Json json = {{"verdict", name_of(q.verdict)}};
  if (!q.reason.empty()) json["reason"] = q.reason;
  json["light"] = name_of(registered.light);
  const std::pair<const char*, double> figures[] = {
      {"correlation", q.correlation},       {"inlier_share", q.inlier_share},
      {"visible_share", q.visible_share},   {"outline_share", q.outline_share},
      {"position_sd_mm", q.position_sd_mm}, {"rotation_sd_deg", q.rotation_sd_deg},
      {"surface_sd_mm", q.surface_sd_mm},   {"runner_up_margin", q.runner_up_margin},
      {"focal_scale", q.focal_scale}};
  for (const auto& [name, value] : figures) json[name] = value;
  if (q.depth)
    json["depth"] = {{"agreeing_share", q.depth->share},
                     {"pierced_share", q.depth->pierced_share},
                     {"noise_mm", q.depth->noise_mm},
                     {"scale", q.depth->scale},
                     {"free_scale", q.depth->free_scale},
                     {"scale_sd", q.depth->scale_sd},
                     {"runner_up_margin", q.depth->runner_up_margin}};
  return json;
}

bool is_ok(const NamedPose& pose) { return pose.registered.quality.verdict == Verdict::ok; }

}  // namespace

CameraSet posed_cameras(const std::vector<NamedPose>& poses, bool all) {
  CameraSet set;
  for (const NamedPose& pose : poses) {
    if (!all && !is_ok(pose)) continue;
    set.cameras.push_back(pose.registered.camera);
    set.cameras.back().name = pose.image;
    set.images.push_back(pose.image);
  }
  return set;
}

std::string pose_document(const std::vector<NamedPose>& poses) {
  Json document = Json::parse(cameras_to_json(posed_cameras(poses, true)));
  const Json all = document["cameras"];
  document["cameras"] = Json::array();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Json camera = all[i];
    camera["registration"] = verdict_json(poses[i].registered);
    if (is_ok(poses[i])) {
      document["cameras"].push_back(camera);
    } else {
      document["left_out"].push_back(camera);
    }
  }
  return document.dump(2) + "\n";
}

}  // namespace organbake
