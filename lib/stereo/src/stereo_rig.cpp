// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/stereo/stereo_rig.h"

#include <Eigen/Geometry>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/lens_check.h"
#include "organbake/formats/named_matrices.h"
#include "organbake/geometry/rigid_transform.h"
#include "rig_of_matrices.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

bool ends_with_one_of(const fs::path& file, std::initializer_list<const char*> endings) {
  const std::string name = file.filename().string();
  for (const char* ending : endings)
    if (name.ends_with(ending)) return true;
  return false;
}

// The text in a folder whose name holds this word.
std::optional<NamedMatrices::Matrix> matrix_named(const fs::path& folder, const std::string& word) {
  for (const fs::path& file : list_files(folder))
    if (file.filename().string().find(word) != std::string::npos)
      return read_matrix_file(folder / file);
  return std::nullopt;
}

StereoRig rig_of_texts(const fs::path& folder, const EyePictures& pictures) {
  NamedMatrices found;
  const std::pair<const char*, const char*> parts[] = {{"left.intrinsics", "k1"},
                                                       {"left.distortion", "d1"},
                                                       {"right.intrinsics", "k2"},
                                                       {"right.distortion", "d2"}};
  for (const auto& [word, name] : parts)
    if (auto rows = matrix_named(folder, word)) found.matrices[name] = std::move(*rows);
  const auto pose = matrix_named(folder, "l2r");
  if (!found.find({"k1"}) || !found.find({"k2"}) || !pose)
    throw BadDataError(folder,
                       "holds no stereo calibration: neither a YAML file nor texts named "
                       "*left.intrinsics*, *right.intrinsics* and *l2r*");
  const auto& v = pose->values;
  const bool below = pose->rows == 4 && pose->columns == 3;
  if (!below && !(pose->columns == 4 && (pose->rows == 3 || pose->rows == 4)))
    throw BadDataError(folder, "its *l2r* must hold three rows of R and one of T, or rows of R|T");
  NamedMatrices::Matrix r{{}, 3, 3}, t{{}, 3, 1};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      r.values.push_back(v[std::size_t(row * pose->columns + column)]);
    t.values.push_back(below ? v[std::size_t(9 + row)] : v[std::size_t(4 * row + 3)]);
  }
  found.matrices["r"] = r;
  found.matrices["t"] = t;
  return rig_of_matrices(found, folder, pictures);
}

StereoRig rig_of_folder(const fs::path& folder, const EyePictures& pictures) {
  NamedMatrices found;
  for (const fs::path& file : list_files(folder))
    if (ends_with_one_of(file, {".yml", ".yaml", ".json", ".xml", ".ini"}))
      add_opencv_document(folder / file, found);
  return found.matrices.empty() && found.parts.empty() ? rig_of_texts(folder, pictures)
                                                       : rig_of_matrices(found, folder, pictures);
}

StereoRig rig_of_cameras(const fs::path& path, const EyePictures& pictures) {
  const CameraSet set = read_camera_file(path);
  if (set.cameras.size() < 2)
    throw BadDataError(path, "holds " + std::to_string(set.cameras.size()) +
                                 " camera; a stereo endoscope has two");
  const auto left = camera_with_image(set, pictures.left);
  const auto right = camera_with_image(set, pictures.right);
  const bool named = left && right && *left != *right;
  const PosedCamera& a = set.cameras[named ? *left : 0];
  const PosedCamera& b = set.cameras[named ? *right : 1];
  StereoRig rig{a.intrinsics, b.intrinsics, b.camera_from_world * a.camera_from_world.inverse()};
  rig.right_from_left.translation *= pictures.mm_per_unit;
  return rig;
}

bool is_camera_document(const fs::path& path) {
  if (fs::is_directory(path) || is_colmap_model(path)) return is_colmap_model(path);
  const std::string text = read_text_file(path);
  return first_letter(text) == '{' && (text.find("\"cameras\"") != std::string::npos ||
                                       text.find("\"frames\"") != std::string::npos);
}

void check_baseline(const StereoRig& rig, const fs::path& path) {
  constexpr double kLeast_mm = 0.2, kMost_mm = 200;  // of endoscopes, with room for tables
  const Eigen::Vector3d& t = rig.right_from_left.translation;
  const double apart = rig.baseline_mm();
  if (!(apart >= kLeast_mm && apart <= kMost_mm))
    throw BadDataError(path, "has the eyes " + to_text(apart) + " mm apart; that must be in " +
                                 to_text(kLeast_mm) + "…" + to_text(kMost_mm) +
                                 " mm (is its unit another one? --unit m, cm)");
  // Where the right eye stands, in the left one's axes.
  const Eigen::Vector3d at = -(rig.right_from_left.rotation.transpose() * t);
  constexpr double kAlong = 0.7;
  if (at.x() <= -kAlong * apart)
    throw BadDataError(path,
                       "has the second eye on the left of the first: give the right eye's "
                       "calibration second, and its picture");
  if (at.x() < kAlong * apart)
    throw BadDataError(path, "has the eyes one above or behind the other (" + to_text(at.x(), 2) +
                                 ", " + to_text(at.y(), 2) + ", " + to_text(at.z(), 2) +
                                 " mm); they must stand side by side");
}

}  // namespace

StereoRig read_stereo_rig(const fs::path& path, const EyePictures& pictures) {
  if (!fs::exists(path)) throw NoInputError(path, "there is no such file or folder");
  StereoRig rig;
  if (is_camera_document(path)) {
    rig = rig_of_cameras(path, pictures);
  } else if (fs::is_directory(path)) {
    rig = rig_of_folder(path, pictures);
  } else {
    NamedMatrices found;
    add_opencv_document(path, found);
    rig = rig_of_matrices(found, path, pictures);
  }
  check_lens_of_picture(rig.left, pictures.width, pictures.height, path, "left");
  check_lens_of_picture(rig.right, pictures.width, pictures.height, path, "right");
  check_baseline(rig, path);
  return rig;
}

}  // namespace organbake
