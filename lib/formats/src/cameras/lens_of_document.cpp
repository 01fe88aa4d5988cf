// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/lens_of_document.h"

#include <Eigen/Core>
#include <string>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/geometry/written_rotation.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Rows = NamedMatrices::Rows;

const Rows& needed(const Rows* rows, std::size_t count, const char* name, const fs::path& path) {
  if (rows && rows->values.size() == count) return *rows;
  throw BadDataError(path, std::string("needs ") + std::to_string(count) + " numbers under '" +
                               name + "' of each camera");
}

double needed(std::optional<double> number, const std::string& name, const fs::path& path) {
  if (number) return *number;
  throw BadDataError(path, "needs a number '" + name + "' of each camera");
}

Rows camera_matrix(double fx, double fy, double cx, double cy) {
  return {{fx, 0, cx, 0, fy, cy, 0, 0, 1}, 3, 3};
}

RigidTransform pose_of(const Eigen::Matrix3d& written, const Eigen::Vector3d& translation,
                       const fs::path& path) {
  const auto rotation = written_rotation(written);
  if (!rotation || !translation.allFinite())
    throw BadDataError(path, "holds no proper rotation between its eyes");
  return {*rotation, translation};
}

Eigen::Matrix3d matrix3(const std::vector<double>& v, std::size_t stride) {
  Eigen::Matrix3d m;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      m(Eigen::Index(row), Eigen::Index(column)) = v[row * stride + column];
  return m;
}

// Kalibr ------------------------------------------------------------------------------------------

const NamedMatrices* kalibr_camera(const NamedMatrices& found, EndoscopeEye eye) {
  const NamedMatrices* camera = found.part({eye == EndoscopeEye::left ? "cam0" : "cam1"});
  return camera &&
                 (camera->matrices.contains("intrinsics") || camera->faults.contains("intrinsics"))
             ? camera
             : nullptr;
}

Intrinsics kalibr_lens(const NamedMatrices& camera, int width, int height, const fs::path& path) {
  const Rows& k = needed(camera.find({"intrinsics"}), 4, "intrinsics", path);
  const auto& v = k.values;
  return lens_of_matrices(camera, camera_matrix(v[0], v[1], v[2], v[3]),
                          camera.find({"distortioncoeffs"}), sized_lens(camera, width, height),
                          path);
}

// StereoMIS ---------------------------------------------------------------------------------------

const NamedMatrices* ini_camera(const NamedMatrices& found, EndoscopeEye eye) {
  return found.part({eye == EndoscopeEye::left ? "stereoleft" : "stereoright"});
}

Intrinsics ini_lens(const NamedMatrices& camera, int width, int height, const fs::path& path) {
  const auto number = [&](const char* name) { return needed(camera.number({name}), name, path); };
  Intrinsics sized;
  sized.width = camera.number({"resx"}) ? written_size(number("resx")) : width;
  sized.height = camera.number({"resy"}) ? written_size(number("resy")) : height;
  Rows d{{}, 1, 0};
  for (std::string name = "kc0"; camera.words.contains(name);
       name = "kc" + std::to_string(d.values.size()))
    d.values.push_back(number(name.c_str()));
  d.columns = static_cast<int>(d.values.size());
  return lens_of_matrices(camera,
                          camera_matrix(number("fcx"), number("fcy"), number("ccx"), number("ccy")),
                          d.values.empty() ? nullptr : &d, sized, path);
}

RigidTransform ini_pose(const NamedMatrices& right, const fs::path& path) {
  std::vector<double> r, t;
  for (int i = 0; i < 9; ++i)
    r.push_back(needed(right.number({("r" + std::to_string(i)).c_str()}), "R_0 … R_8", path));
  for (int i = 0; i < 3; ++i)
    t.push_back(needed(right.number({("t" + std::to_string(i)).c_str()}), "T_0 … T_2", path));
  return pose_of(matrix3(r, 3), {t[0], t[1], t[2]}, path);
}

// MATLAB ------------------------------------------------------------------------------------------

bool is_matlab(const NamedMatrices& camera) {
  return camera.matrices.contains("radialdistortion") || camera.faults.contains("radialdistortion");
}

const NamedMatrices* matlab_camera(const NamedMatrices& found, EndoscopeEye eye) {
  if (const NamedMatrices* camera =
          found.part({eye == EndoscopeEye::left ? "cameraparameters1" : "cameraparameters2"}))
    return is_matlab(*camera) ? camera : nullptr;
  if (const NamedMatrices* inner = found.part({"intrinsics"}); inner && is_matlab(*inner))
    return inner;
  return is_matlab(found) ? &found : nullptr;
}

// Its older IntrinsicMatrix is transposed.
Rows matlab_matrix(const NamedMatrices& camera, const fs::path& path) {
  const Rows* focal = camera.find({"focallength"});
  const Rows* centre = camera.find({"principalpoint"});
  if (focal && centre)
    return camera_matrix(needed(focal, 2, "FocalLength", path).values[0], focal->values[1],
                         needed(centre, 2, "PrincipalPoint", path).values[0], centre->values[1]);
  if (const Rows* k = camera.find({"k"})) return needed(k, 9, "K", path);
  const auto& m = needed(camera.find({"intrinsicmatrix"}), 9, "IntrinsicMatrix", path).values;
  return {{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}, 3, 3};
}

Intrinsics matlab_lens(const NamedMatrices& camera, int width, int height, const fs::path& path) {
  const Rows* radial = camera.find({"radialdistortion"});
  if (!radial || radial->values.size() < 2 || radial->values.size() > 3)
    throw BadDataError(path, "needs two or three numbers under 'RadialDistortion'");
  const Rows* tangential = camera.find({"tangentialdistortion"});
  std::vector<double> d = {radial->values[0], radial->values[1], 0, 0,
                           radial->values.size() == 3 ? radial->values[2] : 0};
  if (tangential) {
    d[2] = needed(tangential, 2, "TangentialDistortion", path).values[0];
    d[3] = tangential->values[1];
  }
  Intrinsics sized;
  sized.width = width;
  sized.height = height;
  if (const Rows* size = camera.find({"imagesize"})) {
    sized.height = written_size(needed(size, 2, "ImageSize", path).values[0]);
    sized.width = written_size(size->values[1]);
  }
  const Rows distortion{std::move(d), 1, 5};
  Intrinsics lens = lens_of_matrices(camera, matlab_matrix(camera, path), &distortion, sized, path);
  lens.cx -= 1;  // its first pixel's centre is (1, 1)
  lens.cy -= 1;
  return lens;
}

// Row vectors: x_right = x_left R + t.
std::optional<RigidTransform> matlab_pose(const NamedMatrices& found, const fs::path& path) {
  if (const NamedMatrices* pose = found.part({"posecamera2"})) {
    const auto& r = needed(pose->find({"r"}), 9, "PoseCamera2.R", path).values;
    const auto& t = needed(pose->find({"translation"}), 3, "PoseCamera2.Translation", path).values;
    return pose_of(matrix3(r, 3), {t[0], t[1], t[2]}, path);
  }
  const Rows* rotation = found.find({"rotationofcamera2"});
  if (!rotation) return std::nullopt;
  const auto& t =
      needed(found.find({"translationofcamera2"}), 3, "TranslationOfCamera2", path).values;
  return pose_of(matrix3(needed(rotation, 9, "RotationOfCamera2", path).values, 3).transpose(),
                 {t[0], t[1], t[2]}, path);
}

}  // namespace

std::optional<Intrinsics> lens_of_parts(const NamedMatrices& found, EndoscopeEye eye, int width,
                                        int height, const fs::path& path) {
  if (const NamedMatrices* camera = kalibr_camera(found, eye))
    return kalibr_lens(*camera, width, height, path);
  if (const NamedMatrices* camera = ini_camera(found, eye))
    return ini_lens(*camera, width, height, path);
  if (const NamedMatrices* camera = matlab_camera(found, eye))
    return matlab_lens(*camera, width, height, path);
  return std::nullopt;
}

std::optional<PoseOfParts> pose_of_parts(const NamedMatrices& found, const fs::path& path) {
  if (const NamedMatrices* right = kalibr_camera(found, EndoscopeEye::right)) {
    constexpr double kMetre_mm = 1000;
    const auto& v = needed(right->find({"tcncnm1"}), 16, "T_cn_cnm1", path).values;
    return PoseOfParts{pose_of(matrix3(v, 4), {v[3], v[7], v[11]}, path), kMetre_mm};
  }
  if (const NamedMatrices* right = ini_camera(found, EndoscopeEye::right))
    return PoseOfParts{ini_pose(*right, path), std::nullopt};
  if (const auto pose = matlab_pose(found, path)) return PoseOfParts{*pose, std::nullopt};
  return std::nullopt;
}

const NamedMatrices& matrices_of(const NamedMatrices& found) {
  const NamedMatrices* inside = found.part({"cameracalibration"});
  return inside ? *inside : found;
}

}  // namespace organbake
