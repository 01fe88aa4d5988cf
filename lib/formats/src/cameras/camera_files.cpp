// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/camera_files.h"
#include "organbake/core/text.h"

#include <cstring>
#include <nlohmann/json.hpp>

#include "cameras/colmap.h"
#include "cameras/foreign_calibration.h"
#include "cameras/transforms_json.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/formats/lens_of_document.h"
#include "organbake/formats/named_matrices.h"
#include "organbake/geometry/camera.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// The left eye's, where it is a stereo calibration.
Intrinsics opencv_lens(const std::string& text, const fs::path& path, int width, int height) {
  NamedMatrices document;
  add_opencv_text(text, path, document);
  if (const auto lens = lens_of_parts(document, EndoscopeEye::left, width, height, path))
    return *lens;
  const NamedMatrices& found = matrices_of(document);
  const auto* k = found.find({"cameramatrix", "k", "m", "intrinsicmatrix"});
  if (!k) k = found.find(kLeftCameraMatrix);
  if (!k)
    throw BadDataError(path,
                       "holds neither the 3×3 matrix 'camera_matrix' of an OpenCV calibration nor "
                       "fx, fy, cx and cy");
  const auto* d = found.find(kDistortion);
  if (!d) d = found.find(kLeftDistortion);
  return lens_of_matrices(found, *k, d, sized_lens(found, width, height), path);
}

CameraSet colmap_model(const fs::path& path, const RunContext& context) {
  if (!fs::is_directory(path))
    return path.extension() == ".bin" ? read_colmap_binary(path.parent_path(), context)
                                      : read_colmap_text(path.parent_path(), context);
  const fs::path sparse = path / "sparse" / "0";
  for (const fs::path& folder : {sparse, path}) {
    if (!is_colmap_model(folder)) continue;
    return fs::exists(folder / "cameras.txt") ? read_colmap_text(folder, context)
                                              : read_colmap_binary(folder, context);
  }
  throw NoInputError(path, "holds no COLMAP model: neither cameras.txt nor cameras.bin");
}

CameraSet cameras_of(const Json& json, const std::string& text, const fs::path& path) {
  return json.contains("frames") ? transforms_from_json(json, path, std::nullopt)
                                 : cameras_from_json(text, path.string());
}

Intrinsics lens_of(const CameraSet& set, const std::string& image, const fs::path& path) {
  if (set.cameras.empty()) throw BadDataError(path, "holds no camera");
  return set.cameras[camera_with_image(set, image).value_or(0)].intrinsics;
}

Intrinsics lens_in(const fs::path& path, const std::string& image, int width, int height) {
  if (fs::is_directory(path) || is_colmap_model(path))
    return lens_of(colmap_model(path, {}), image, path);
  const std::string text = read_text_file(path);
  if (first_letter(text) != '{') return opencv_lens(text, path, width, height);
  const Json json = parse_json(text, path.string());
  if (json.contains("frames"))
    return lens_of(transforms_from_json(json, path, {{width, height}}), image, path);
  if (json.contains("cameras")) return lens_of(cameras_from_json(text, path.string()), image, path);
  const bool plain = json.contains("fx") || json.contains("fy") || json.contains("cx");
  return plain ? intrinsics_from_json(JsonField(json, path.string()), kLargestPhotoSide_px)
               : opencv_lens(text, path, width, height);
}

}  // namespace

bool is_colmap_model(const fs::path& path) {
  if (fs::is_directory(path))
    return fs::exists(path / "cameras.txt") || fs::exists(path / "cameras.bin");
  const std::string name = path.filename().string();
  return name == "cameras.txt" || name == "images.txt" || name == "cameras.bin" ||
         name == "images.bin";
}

CameraSet read_camera_file(const fs::path& path, const RunContext& context) {
  if (!fs::exists(path)) throw NoInputError(path, "there is no such file or folder");
  if (fs::is_directory(path) || is_colmap_model(path)) return colmap_model(path, context);
  const std::string text = read_text_file(path);
  if (first_letter(text) != '{') {
    refuse_foreign_calibration(text, path);
    throw BadDataError(path, "is neither a cameras.json, a transforms.json nor a COLMAP model");
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
