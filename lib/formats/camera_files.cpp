// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/camera_files.h"

#include <yaml-cpp/yaml.h>

#include <nlohmann/json.hpp>

#include "bundle/json_fields.h"
#include "core/error.h"
#include "core/files.h"
#include "formats/foreign_cameras.h"
#include "geometry/camera.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

bool is_colmap(const fs::path& path) {
  return fs::is_directory(path) || path.filename() == "cameras.txt" ||
         path.filename() == "images.txt";
}

// A matrix as FileStorage writes it, row by row; empty when none of the names is there.
std::vector<double> opencv_matrix(const YAML::Node& root,
                                  std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const YAML::Node node = root[name];
    if (node && node["data"]) return node["data"].as<std::vector<double>>();
  }
  return {};
}

Intrinsics opencv_lens(std::string text, const fs::path& path, int width, int height) {
  // yaml-cpp refuses OpenCV's "%YAML:1.0".
  if (text.starts_with("%YAML")) text.erase(0, text.find('\n'));
  try {
    const YAML::Node root = YAML::Load(text);
    const auto m = opencv_matrix(root, {"camera_matrix", "cameraMatrix", "K", "M1"});
    if (m.size() != 9) {
      throw BadDataError(path, "lacks the 3×3 matrix 'camera_matrix' of an OpenCV calibration");
    }
    auto d = opencv_matrix(root, {"distortion_coefficients", "distCoeffs", "D", "D1"});
    for (std::size_t i = 5; i < d.size(); ++i) {
      if (d[i] != 0) throw BadDataError(path, "only k1 k2 p1 p2 k3 of a distortion are supported");
    }
    d.resize(5, 0);
    Intrinsics k;
    k.width = root["image_width"] ? root["image_width"].as<int>() : width;
    k.height = root["image_height"] ? root["image_height"].as<int>() : height;
    k.fx = m[0];
    k.fy = m[4];
    k.cx = m[2] + 0.5;
    k.cy = m[5] + 0.5;
    k.k1 = d[0];
    k.k2 = d[1];
    k.p1 = d[2];
    k.p2 = d[3];
    k.k3 = d[4];
    return k;
  } catch (const YAML::Exception& error) {
    throw BadDataError(path, "is no OpenCV calibration: " + error.msg);
  }
}

bool is_json(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string::npos && text[first] == '{';
}

CameraSet colmap_model(const fs::path& path) {
  if (!fs::is_directory(path)) return read_colmap_text(path.parent_path());
  const fs::path sparse = path / "sparse" / "0";
  return read_colmap_text(fs::exists(sparse / "cameras.txt") ? sparse : path);
}

CameraSet cameras_of(const Json& json, const std::string& text, const fs::path& path) {
  return json.contains("frames") ? transforms_from_json(json, path)
                                 : cameras_from_json(text, path.string());
}

Intrinsics lens_of(const CameraSet& set, const std::string& image, const fs::path& path) {
  if (set.cameras.empty()) throw BadDataError(path, "holds no camera");
  return set.cameras[camera_with_image(set, image).value_or(0)].intrinsics;
}

Intrinsics lens_in(const fs::path& path, const std::string& image, int width, int height) {
  if (is_colmap(path)) return lens_of(colmap_model(path), image, path);
  const std::string text = read_text_file(path);
  if (!is_json(text)) return opencv_lens(text, path, width, height);
  const Json json = parse_json(text, path.string());
  return json.contains("cameras") || json.contains("frames")
             ? lens_of(cameras_of(json, text, path), image, path)
             : intrinsics_from_json(JsonField(json, path.string()), kLargestPhotoSide_px);
}

}  // namespace

CameraSet read_camera_file(const fs::path& path) {
  if (!fs::exists(path)) throw NoInputError(path, "there is no such file or folder");
  if (is_colmap(path)) return colmap_model(path);
  const std::string text = read_text_file(path);
  if (!is_json(text)) {
    throw BadDataError(path,
                       "is neither a cameras.json, a transforms.json nor a COLMAP text model");
  }
  return cameras_of(parse_json(text, path.string()), text, path);
}

std::optional<std::size_t> camera_with_image(const CameraSet& set, const std::string& image) {
  for (std::size_t i = 0; i < set.images.size(); ++i) {
    if (fs::path(set.images[i]).filename() == fs::path(image).filename()) return i;
  }
  return std::nullopt;
}

Intrinsics read_intrinsics(const fs::path& path, const std::string& image, int width, int height) {
  if (!fs::exists(path)) throw NoInputError(path, "there is no such file");
  const Intrinsics lens = lens_in(path, image, width, height);
  try {
    lens.check();
  } catch (const BadDataError& error) {
    throw BadDataError(path, error.what());
  }
  return lens;
}

}  // namespace organbake
