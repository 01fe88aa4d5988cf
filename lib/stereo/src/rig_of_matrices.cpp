// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_of_matrices.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/formats/lens_of_document.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/rigid_transform.h"

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

}  // namespace

StereoRig rig_of_matrices(const NamedMatrices& document, const fs::path& path,
                          const EyePictures& pictures) {
  if (const auto rig = rig_of_parts(document, path, pictures)) return *rig;
  const NamedMatrices& found = matrices_of(document);
  check_finite(found, path);
  const Intrinsics sized = sized_lens(found, pictures.width, pictures.height);
  const Matrix* k1 = found.find(kLeftCameraMatrix);
  const Matrix* k2 = found.find({"k2", "m2", "cameramatrix2", "cm2", "cameramatrixr", "kr", "mr",
                                 "cameramatrixright", "rightcameramatrix", "kright", "intrinsic2"});
  const Rectified rectified{found.find({"r1"}), found.find({"r2"}), found.find({"p1"}),
                            found.find({"p2"}), found.find({"q"})};
  StereoRig rig;
  if (!k1 || !k2) {
    rig = rig_of_rectified(rectified, sized, path);
  } else {
    const Matrix* d1 = found.find(kLeftDistortion);
    const Matrix* d2 = found.find(kRightDistortion);
    rig.left = lens_of_matrices(found, *k1, d1, sized, path);
    rig.right = lens_of_matrices(found, *k2, d2, sized, path);
    const auto r = rotation_of(found.find({"r", "rotation", "rotationmatrix", "om"}));
    const auto t = vector_of(found.find({"t", "translation", "translationvector", "trans"}));
    const auto pose = r && t ? RigidTransform{*r, *t} : pose_of_rectification(rectified);
    if (!pose)
      throw BadDataError(path,
                         "lacks how the eyes stand to each other: a proper rotation R (3x3) and T "
                         "(3 numbers), or R1, R2 and P2");
    rig.right_from_left = *pose;
  }
  rig.right_from_left.translation *= pictures.mm_per_unit;
  return rig;
}

}  // namespace organbake
