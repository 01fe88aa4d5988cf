// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The calibration of a stereo endoscope, from files, and its pictures turned so that rows are rows.

#include <filesystem>
#include <memory>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/image/picture.h"

namespace organbake {

// The two eyes of a stereo endoscope and how they stand to each other.
struct StereoRig {
  Intrinsics left, right;
  RigidTransform right_from_left;  // mm

  double baseline_mm() const { return right_from_left.translation.norm(); }
};

// What the pictures are, and in what unit the file has its lengths.
struct EyePictures {
  int width = 0, height = 0;          // of each eye's picture
  std::string left = {}, right = {};  // file names, to find the cameras that took them by
  double mm_per_unit = 1;             // of the calibration's lengths
};

// A stereo calibration in any of these forms, told apart by content:
// - OpenCV's, YAML, JSON or XML: the matrices K, D of each eye with R, T (x_right = R x_left + T),
// under
//   the names usual for them (K1, M1, cameraMatrix1 … D1, distCoeffs1 …); or K, D with R1, R2, P1,
//   P2; or P1, P2 or Q alone, of pictures that are rectified already. May be split in two files of
//   one folder (intrinsics.yml, extrinsics.yml).
// - two cameras: our cameras.json, a transforms.json or a COLMAP text model; those that name the
//   pictures, else the first two.
// - a folder of texts with rows of numbers: *left.intrinsic*, *left.distortion*, the same of the
//   right, and *l2r* (rows of R, T beside or below them) or its inverse *r2l*; or of OpenCV's files
//   of one matrix each under such names (*left.intrinsic.xml … *r2l.rotation.xml).
// OpenCV and the texts count from the first pixel's centre: half a pixel is added to cx and cy.
// Throws NoInputError; BadDataError for what is missing or not finite, for eyes in one place, one
// above the other or the right one on the left, and for a calibration of another size.
StereoRig read_stereo_rig(const std::filesystem::path& path, const EyePictures& pictures);

// Two like cameras side by side, whose rows are the same rows: a point in column x of the left
// picture lies in column x − disparity of the right one, and
//   depth = fx · baseline / (disparity − disparity_at_infinity).
struct RectifiedEyes {
  Intrinsics camera;  // of the left picture; without distortion
  double baseline_mm = 0;
  double disparity_at_infinity = 0;    // px: 0 for like principal points
  RigidTransform rectified_from_left;  // a rotation: how the left camera was turned
  // The right picture's camera, in the left rectified one's axes.
  PosedCamera right() const;
};

// Turns the pictures of a rig so (cv::stereoRectify). Pictures that stand so already stay as they
// are, pixel for pixel.
class Rectifier {
 public:
  // Throws BadDataError for a rig that cannot be rectified.
  explicit Rectifier(const StereoRig& rig);
  ~Rectifier();
  Rectifier(Rectifier&&) noexcept;

  const RectifiedEyes& eyes() const;
  bool changes_pictures() const;
  // Black where a picture shows nothing. 8 bits are all that is kept.
  StoredPicture left(StoredPicture picture) const;
  StoredPicture right(StoredPicture picture) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
