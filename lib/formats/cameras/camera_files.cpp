// SPDX-License-Identifier: GPL-3.0-or-later
// Posed cameras and lenses of other programs, told apart by what a file holds: a NeRF's
// transforms.json (as nerfstudio and instant-ngp write it) is read here; COLMAP's models, OpenCV's
// matrices and other calibrations in the files beside.
#include "organbake/formats/camera_files.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "cameras/camera_formats.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/lens_files.h"
#include "organbake/formats/photo.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

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

struct PictureSides {
  int width = 0, height = 0;
};

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
  world_from_camera.rotation = *rotation * kOpenGlAxes;
  return world_from_camera.inverse();
}

// A NeRF's transforms.json (camera_files.h): lens keys at the top or per frame. Where these do not
// tell the pictures' size (camera_angle_x alone), it is `picture`, or else that of the first
// frame's own picture. Throws BadDataError naming `path`, for a lens's key that is no number, too.
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

// Whether a model's text holds the images and poses of its binary files, as far as texts do.
bool says_the_same(const fs::path& folder, const CameraSet& binary) {
  constexpr double kRounding = 1e-6;  // of rotations, and of a translation's length
  try {
    const CameraSet text = read_colmap_text(folder, {});
    if (text.images != binary.images) return false;
    for (std::size_t i = 0; i < text.cameras.size(); ++i) {
      const RigidTransform &a = text.cameras[i].camera_from_world,
                           &b = binary.cameras[i].camera_from_world;
      if ((a.rotation - b.rotation).norm() > kRounding ||
          (a.translation - b.translation).norm() > kRounding * (1 + b.translation.norm()))
        return false;
    }
    return true;
  } catch (const Error&) {
    return false;
  }
}

CameraSet colmap_model(const fs::path& path, const RunContext& context) {
  if (!fs::is_directory(path))
    return path.extension() == ".bin" ? read_colmap_binary(path.parent_path(), context)
                                      : read_colmap_text(path.parent_path(), context);
  const fs::path sparse = path / "sparse" / "0";
  for (const fs::path& folder : {sparse, path}) {
    if (!is_colmap_model(folder)) continue;
    if (!fs::exists(folder / "cameras.bin")) return read_colmap_text(folder, context);
    const CameraSet set = read_colmap_binary(folder, context);
    if (fs::exists(folder / "cameras.txt") && !says_the_same(folder, set))
      context.warn(folder.string() +
                   ": holds two models that differ, as text and binary; the binary one is read, as "
                   "COLMAP does");
    return set;
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
  for (std::size_t i = 0; i < set.images.size(); ++i)
    if (fs::path(set.images[i]).filename() == fs::path(image).filename()) return i;
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
