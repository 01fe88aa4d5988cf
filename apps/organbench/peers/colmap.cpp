// SPDX-License-Identifier: GPL-3.0-or-later
// COLMAP on the same frames, and its models read back.
#include "organbake/pipelines/processes.h"
#include "peers/peers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <sstream>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/camera_files.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr double kOneRun_s = 1e-9;  // of time: no other is begun

struct ModelImage {
  PosedCamera camera;
  std::vector<Eigen::Vector2d> observations;
};

std::vector<Eigen::Vector2d> observations_in(const std::string& line) {
  std::vector<Eigen::Vector2d> pixels;
  std::istringstream words(line);
  Eigen::Vector2d pixel;
  for (long point = 0; words >> pixel.x() >> pixel.y() >> point;) pixels.push_back(pixel);
  return pixels;
}

// By COLMAP's ids; the lens is that of all, the first in cameras.txt.
std::map<int, ModelImage> images_by_id(const fs::path& model) {
  const fs::path file = model / "images.txt";
  std::istringstream text(read_text_file(file));
  const Intrinsics lens = read_camera_file(model).cameras.at(0).intrinsics;
  std::map<int, ModelImage> images;
  for (std::string line; std::getline(text, line);) {
    if (line.empty() || line.starts_with('#')) continue;
    std::istringstream words(line);
    int id = 0;
    Eigen::Quaterniond turn;
    Vector3d shift;
    if (!(words >> id >> turn.w() >> turn.x() >> turn.y() >> turn.z() >> shift.x() >> shift.y() >>
          shift.z()))
      throw BadDataError(file, "holds no image in '" + line + "'");
    std::getline(text, line);  // its observations, perhaps none
    images[id] = {{"", lens, {turn.normalized().toRotationMatrix(), shift}}, observations_in(line)};
  }
  return images;
}

double largest_angle_deg(const Vector3d& point, const std::vector<Vector3d>& centers) {
  double least_cosine = 1;
  for (std::size_t i = 0; i < centers.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      least_cosine = std::min(
          least_cosine, (centers[i] - point).normalized().dot((centers[j] - point).normalized()));
  return std::acos(std::clamp(least_cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

// What the point's own frames say of it; the error of a point without tracks is left as it is.
void measure(ModelPoint& point, const std::map<int, std::vector<int>>& track,
             const std::map<int, ModelImage>& images) {
  std::vector<Vector3d> centers;
  double sum = 0, count = 0;
  for (const auto& [id, observations] : track) {
    const auto image = images.find(id);
    if (image == images.end()) continue;
    centers.push_back(image->second.camera.center_world_mm());
    for (const int index : observations) {
      const Eigen::Vector2d& seen = image->second.observations.at(static_cast<std::size_t>(index));
      sum += (project(image->second.camera, point.place) - seen).norm();
      count += 1;
    }
  }
  point.sightings = centers.size();
  point.largest_angle_deg = largest_angle_deg(point.place, centers);
  if (count > 0) point.error_px = sum / count;
}

// One of colmap's commands: its name and options apart by spaces, then those that are paths. Its Qt
// wants no screen.
void call(const std::string& words, const std::vector<std::string>& paths, const ColmapRun& run,
          const RunContext& context) {
  std::vector<std::string> command = {"/usr/bin/env", "QT_QPA_PLATFORM=offscreen", "colmap"};
  std::istringstream text(words);
  for (std::string word; text >> word;) command.push_back(word);
  command.insert(command.end(), paths.begin(), paths.end());
  run_worker(command, run.work / "colmap.out", run.work / "colmap.log", context);
}

void find_features(const ColmapRun& run, const RunContext& context) {
  std::string words =
      "feature_extractor --ImageReader.camera_model SIMPLE_RADIAL --ImageReader.single_camera 1 "
      "--SiftExtraction.use_gpu 0";
  if (run.lens)
    words += " --ImageReader.camera_params " + to_text(run.lens->fx) + "," + to_text(run.lens->cx) +
             "," + to_text(run.lens->cy) + "," + to_text(run.lens->k1);
  call(words,
       {"--database_path", run.database(), "--image_path", run.frames, "--ImageReader.mask_path",
        run.masks},
       run, context);
}

// First pair from 4 degrees and points from 0.7: a scope moves little for its distance.
void map_frames(const ColmapRun& run, const RunContext& context) {
  const std::string refine = run.lens ? "0" : "1";
  call(
      "mapper --Mapper.init_min_tri_angle 4 --Mapper.tri_min_angle 0.7 "
      "--Mapper.filter_min_tri_angle 0.7 --Mapper.min_num_matches 12 "
      "--Mapper.abs_pose_min_num_inliers 15 --Mapper.ba_refine_focal_length " +
          refine + " --Mapper.ba_refine_extra_params " + refine,
      {"--database_path", run.database(), "--image_path", run.frames, "--output_path",
       run.work / "sparse"},
      run, context);
}

// The model with the most frames, as text; empty when there is none.
fs::path largest_model(const ColmapRun& run, const RunContext& context) {
  fs::path largest;
  std::size_t most = 0;
  for (const auto& entry : fs::directory_iterator(run.work / "sparse")) {
    if (!entry.is_directory()) continue;
    const std::size_t frames = read_camera_file(entry.path()).cameras.size();
    if (frames > most) most = frames, largest = entry.path();
  }
  if (largest.empty()) return {};
  const fs::path text = run.work / "text";
  fs::create_directories(text);
  call("model_converter --output_type TXT", {"--input_path", largest, "--output_path", text}, run,
       context);
  return text;
}

}  // namespace

std::vector<ModelPoint> read_model_points(const fs::path& model) {
  const std::map<int, ModelImage> images = images_by_id(model);
  std::vector<ModelPoint> points;
  std::istringstream text(read_text_file(model / "points3D.txt"));
  for (std::string line; std::getline(text, line);) {
    if (line.empty() || line.starts_with('#')) continue;
    std::istringstream words(line);
    ModelPoint point;
    long id = 0;
    int red = 0, green = 0, blue = 0, image = 0, observation = 0;
    if (!(words >> id >> point.place.x() >> point.place.y() >> point.place.z() >> red >> green >>
          blue >> point.error_px))
      throw BadDataError(model / "points3D.txt", "holds no point in '" + line + "'");
    std::map<int, std::vector<int>> track;
    while (words >> image >> observation) track[image].push_back(observation);
    measure(point, track, images);
    points.push_back(point);
  }
  return points;
}

ModelQuality quality_of(const std::vector<ModelPoint>& points) {
  constexpr std::size_t kLeastFrames = 3;
  constexpr double kLeastAngle_deg = 2;
  ModelQuality quality;
  double sum = 0, sightings = 0;
  for (const ModelPoint& point : points) {
    if (point.sightings < kLeastFrames || point.largest_angle_deg <= kLeastAngle_deg) continue;
    ++quality.points;
    sum += point.error_px * static_cast<double>(point.sightings);
    sightings += static_cast<double>(point.sightings);
  }
  if (sightings > 0) quality.reprojection_px = sum / sightings;
  return quality;
}

bool has_colmap() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (fs::exists(fs::path(folder) / "colmap")) return true;
  return false;
}

std::optional<ColmapResult> run_colmap(const ColmapRun& run, const RunContext& context) {
  fs::create_directories(run.work / "sparse");
  ColmapResult result;
  const auto work = [&] {
    find_features(run, context);
    call("sequential_matcher --SiftMatching.use_gpu 0", {"--database_path", run.database()}, run,
         context);
    map_frames(run, context);
  };
  result.timing = time_in_turn({work}, {.most = 1, .least = 1, .budget_s = kOneRun_s}).front();
  const fs::path model = largest_model(run, context);
  if (model.empty()) return {};
  result.cameras = read_camera_file(model);
  result.points = read_model_points(model);
  return result;
}

}  // namespace organbake
