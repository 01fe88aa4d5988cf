// SPDX-License-Identifier: GPL-3.0-or-later
// Stereo calibrations in the forms that programs write, told apart by their content.
#include "organbake/stereo/stereo_depth.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/lens_files.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Matrix = NamedMatrices::Matrix;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// What the matrices of a rectification are named; P is 3×4, Q 4×4.
struct Rectified {
  const Matrix *r1, *r2, *p1, *p2, *q;
};

bool is_size(const Matrix* rows, int height, int width) {
  return rows && rows->rows == height && rows->columns == width;
}

// 3 numbers, whichever way they lie.
std::optional<Vector3d> vector_of(const Matrix* rows) {
  if (!rows || rows->values.size() != 3) return std::nullopt;
  return Vector3d(rows->values[0], rows->values[1], rows->values[2]);
}

// A rotation matrix, or three numbers of Rodrigues.
std::optional<Matrix3d> rotation_of(const Matrix* rows) {
  if (const auto axis = vector_of(rows)) {
    const double angle = axis->norm();
    return angle == 0 ? Matrix3d::Identity()
                      : Eigen::AngleAxisd(angle, *axis / angle).toRotationMatrix();
  }
  if (!is_size(rows, 3, 3)) return std::nullopt;
  const Matrix3d r =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows->values.data());
  return written_rotation(r);
}

// Pictures that are rectified already: the right eye stands to the right by the baseline.
StereoRig rig_of_rectified(const Rectified& m, const Intrinsics& sized, const fs::path& path) {
  StereoRig rig{sized, sized, {}};
  double translation = 0;
  if (is_size(m.p1, 3, 4) && is_size(m.p2, 3, 4)) {
    const auto &a = m.p1->values, &b = m.p2->values;
    set_opencv_pinhole(a[0], a[5], a[2], a[6], rig.left);
    set_opencv_pinhole(b[0], b[5], b[2], b[6], rig.right);
    // P = K [I | t]: the first may have a t of its own.
    translation = b[3] / b[0] - a[3] / a[0];
    if (b[7] != 0)
      throw BadDataError(path, "P2 is of eyes one above the other; they must stand side by side");
  } else if (is_size(m.q, 4, 4)) {
    const auto& q = m.q->values;
    if (q[14] == 0) throw BadDataError(path, "Q is of eyes in one place");
    set_opencv_pinhole(q[11], q[11], -q[3], -q[7], rig.left);
    set_opencv_pinhole(q[11], q[11], -q[3] + q[15] / q[14], -q[7], rig.right);
    translation = -1 / q[14];
  } else {
    throw BadDataError(path,
                       "lacks the matrices of a stereo calibration: K1, D1, K2, D2, R, T (or "
                       "M1 …, cameraMatrix1 …), or P1 and P2, or Q, of rectified pictures");
  }
  rig.right_from_left.translation = {translation, 0, 0};
  return rig;
}

// x_rectified = R1 x_left, and the right eye's is that, moved: x_right = R2ᵀ (R1 x_left + t).
std::optional<RigidTransform> pose_of_rectification(const Rectified& m) {
  const auto r1 = rotation_of(m.r1), r2 = rotation_of(m.r2);
  if (!r1 || !r2 || !is_size(m.p2, 3, 4)) return std::nullopt;
  const auto& p = m.p2->values;
  const Vector3d moved(p[3] / p[0], p[7] / p[5], 0);
  return RigidTransform{r2->transpose() * *r1, r2->transpose() * moved};
}

void check_finite(const NamedMatrices& found, const fs::path& path) {
  for (const auto& [name, rows] : found.matrices)
    for (const double value : rows.values)
      if (!std::isfinite(value)) throw BadDataError(path, "'" + name + "' holds a number like NaN");
}

std::optional<StereoRig> rig_of_parts(const NamedMatrices& document, const fs::path& path,
                                      const EyePictures& pictures) {
  const auto left =
      lens_of_parts(document, EndoscopeEye::left, pictures.width, pictures.height, path);
  if (!left) return std::nullopt;
  const auto right =
      lens_of_parts(document, EndoscopeEye::right, pictures.width, pictures.height, path);
  const auto pose = pose_of_parts(document, path);
  if (!right || !pose)
    throw BadDataError(path,
                       "is of one camera, or lacks how its two stand to each other; a stereo "
                       "endoscope needs both");
  StereoRig rig{*left, *right, pose->right_from_left};
  rig.right_from_left.translation *= pose->mm_per_unit.value_or(pictures.mm_per_unit);
  return rig;
}

// x_right = R x_left + T, its inverse where a file says so (r2l), or what rectification tells.
std::optional<RigidTransform> pose_of_matrices(const NamedMatrices& found,
                                               const Rectified& rectified) {
  const auto motion = [&found](std::initializer_list<const char*> turn,
                               std::initializer_list<const char*> way) {
    const auto r = rotation_of(found.find(turn));
    const auto t = vector_of(found.find(way));
    return r && t ? std::optional(RigidTransform{*r, *t}) : std::nullopt;
  };
  if (const auto pose =
          motion({"r", "rotation", "rotationmatrix", "om", "l2rrotation"},
                 {"t", "translation", "translationvector", "trans", "l2rtranslation"}))
    return pose;
  if (const auto back = motion({"r2lrotation"}, {"r2ltranslation"})) return back->inverse();
  return pose_of_rectification(rectified);
}

// The rig that OpenCV's matrices say: lenses and R, T; or what was rectified (stereo_depth.h).
// `path` is named in errors. Throws BadDataError.
StereoRig rig_of_matrices(const NamedMatrices& document, const fs::path& path,
                          const EyePictures& pictures) {
  if (const auto rig = rig_of_parts(document, path, pictures)) return *rig;
  const NamedMatrices& found = matrices_of(document);
  check_finite(found, path);
  const Intrinsics sized = sized_lens(found, pictures.width, pictures.height);
  const Matrix* k1 = found.find(kLeftCameraMatrix);
  if (!k1) k1 = found.find({"leftintrinsic"});
  const Matrix* k2 = found.find({"k2", "m2", "cameramatrix2", "cm2", "cameramatrixr", "kr", "mr",
                                 "cameramatrixright", "rightcameramatrix", "kright", "intrinsic2",
                                 "rightintrinsic"});
  const Rectified rectified{found.find({"r1"}), found.find({"r2"}), found.find({"p1"}),
                            found.find({"p2"}), found.find({"q"})};
  StereoRig rig;
  if (!k1 || !k2) {
    rig = rig_of_rectified(rectified, sized, path);
  } else {
    const Matrix* d1 = found.find(kLeftDistortion);
    const Matrix* d2 = found.find(kRightDistortion);
    if (!d1) d1 = found.find({"leftdistortion"});
    if (!d2) d2 = found.find({"rightdistortion"});
    rig.left = lens_of_matrices(found, *k1, d1, sized, path);
    rig.right = lens_of_matrices(found, *k2, d2, sized, path);
    const auto pose = pose_of_matrices(found, rectified);
    if (!pose)
      throw BadDataError(path,
                         "lacks how the eyes stand to each other: a proper rotation R (3x3) and T "
                         "(3 numbers), or R1, R2 and P2");
    rig.right_from_left = *pose;
  }
  rig.right_from_left.translation *= pictures.mm_per_unit;
  return rig;
}

bool ends_with_one_of(const fs::path& file, std::initializer_list<const char*> endings) {
  const std::string name = file.filename().string();
  for (const char* ending : endings)
    if (name.ends_with(ending)) return true;
  return false;
}

// The text in a folder whose name holds this word. Throws BadDataError for two that say different
// things.
std::optional<Matrix> matrix_named(const fs::path& folder, const std::string& word) {
  std::optional<Matrix> found;
  std::string name;
  for (const fs::path& file : list_files(folder)) {
    if (file.filename().string().find(word) == std::string::npos) continue;
    Matrix rows = read_matrix_file(folder / file);
    if (found && found->values != rows.values)
      throw BadDataError(folder, "holds '" + name + "' and '" + file.filename().string() +
                                     "', which say different things; keep the one that is meant");
    found = std::move(rows);
    name = file.filename().string();
  }
  return found;
}

// R and T in rows, R|T or T below R, as matrices of their own: rotation and translation.
void add_pose(const Matrix& rows, const std::string& file, const fs::path& folder,
              NamedMatrices& found) {
  const bool below = rows.rows == 4 && rows.columns == 3;
  if (!below && !(rows.columns == 4 && (rows.rows == 3 || rows.rows == 4)))
    throw BadDataError(folder,
                       "its *" + file + "* must hold three rows of R and one of T, or rows of R|T");
  Matrix r{{}, 3, 3}, t{{}, 3, 1};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      r.values.push_back(rows.values[std::size_t(row * rows.columns + column)]);
    t.values.push_back(rows.values[std::size_t(below ? 9 + row : 4 * row + 3)]);
  }
  found.matrices[file + "rotation"] = r;
  found.matrices[file + "translation"] = t;
}

StereoRig rig_of_texts(const fs::path& folder, const EyePictures& pictures) {
  NamedMatrices found;
  for (const std::string eye : {"left", "right"})
    for (const std::string part : {"intrinsic", "distortion"})
      if (auto rows = matrix_named(folder, eye + "." + part))
        found.matrices[eye + part] = std::move(*rows);
  for (const std::string way : {"l2r", "r2l"})
    if (const auto pose = matrix_named(folder, way)) add_pose(*pose, way, folder, found);
  if (!found.find({"leftintrinsic"}) || !found.find({"rightintrinsic"}) ||
      !found.find({"l2rrotation", "r2lrotation"}))
    throw BadDataError(folder,
                       "holds no stereo calibration: neither a YAML file nor texts named "
                       "*left.intrinsic*, *right.intrinsic* and *l2r* or *r2l*");
  return rig_of_matrices(found, folder, pictures);
}

// OpenCV names the only matrix of a file as the file: calib_left_intrinsic, calib_r2l_rotation …;
// what comes before the eye is anyone's.
void name_as_their_files(NamedMatrices& found) {
  for (const std::string known :
       {"leftintrinsic", "rightintrinsic", "leftdistortion", "rightdistortion", "l2rrotation",
        "l2rtranslation", "r2lrotation", "r2ltranslation"}) {
    const auto is_it = [&known](const auto& named) {
      return named.first.ends_with(known) || named.first.ends_with(known + "s");
    };
    const auto matrix = std::find_if(found.matrices.begin(), found.matrices.end(), is_it);
    if (matrix != found.matrices.end()) found.matrices[known] = Matrix(matrix->second);
    const auto fault = std::find_if(found.faults.begin(), found.faults.end(), is_it);
    if (fault != found.faults.end()) found.faults[known] = std::string(fault->second);
  }
}

StereoRig rig_of_folder(const fs::path& folder, const EyePictures& pictures) {
  NamedMatrices found;
  for (const fs::path& file : list_files(folder))
    if (ends_with_one_of(file, {".yml", ".yaml", ".json", ".xml", ".ini"}))
      add_opencv_document(folder / file, found);
  name_as_their_files(found);
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
