// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The calibration of a stereo endoscope, from files, its pictures turned so that rows are rows, and
// depth of what both eyes see.

#include <filesystem>
#include <memory>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/image/picture.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/prepared_frame.h"

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

struct StereoOptions {
  double nearest_mm = 20, farthest_mm = 400;  // of the tissue from the lens
  // Gaps (highlights, what one eye alone sees) that are no wider than this share of the picture's
  // width are closed, where the surface around them is smooth.
  double reach = 0.02;

  void check() const;  // throws UsageError
};

struct StereoDepth {
  FrameDepth depth;                            // of the left rectified picture, metric
  double matched_share = 0, filled_share = 0;  // of the tissue
  // Of the field of view, whatever the masks hide: that has a depth, matched or filled, of all that
  // is lit enough to match or has one; that is lit enough.
  double covered_share = 0, lit_share = 0;
  // Of what is found in both eyes, where that is less than half of what is lit: how much chance
  // would find in a picture of something else; and how much of what is found at any distance lies
  // at others than those that were asked for.
  double chance_share = 0, elsewhere_share = 0;
  double relative_sd = 0;  // of the depth, median over what is matched
  // Of pictures that are made of squares, which match square by square: how far, as a share of the
  // depth, one step of it is from the next, median; else 0.
  double step_share = 0;
  double rows_apart_px = 0, rows_uneven_px = 0;  // up or down between the eyes, median
};

// Depth of what both eyes see. Confidence is 1 / (1 + (σ / 1 %)²) of the depth's relative standard
// deviation, times how alike the eyes see the place; a quarter of that where a gap was closed.
// Throws BadDataError when the pictures are of unlike size or the right eye's is the left one's.
StereoDepth stereo_depth(const PreparedFrame& left, const PreparedFrame& right,
                         const RectifiedEyes& eyes, const StereoOptions& options);

// How the right picture stands to the left one where the calibration says that it does not: what a
// bumped scope, a stretched video or a calibration of another day leaves.
struct RowAlignment {
  double shift_px = 0;  // how far below the left one's its rows lie at the right principal point
  double roll_rad = 0;  // of the right picture about that point, clockwise as seen

  bool needed() const { return shift_px != 0 || roll_rad != 0; }
};

struct PreparedEyes {
  PreparedFrame left, right;
  RowAlignment corrected;  // what was taken out of the right picture
};

// What a recorder has laid over either eye's pictures (InsetFinder), as they come; of no size where
// there is nothing.
struct EyeInsets {
  Mask left, right;
};

// Both pictures rectified, on the same rows, with their masks, ready to be matched. Rows that are
// apart are seen from features of both pictures and corrected, where they are apart by more than
// chance. What the masks take for an instrument stays tissue where both eyes see it on the surface
// around it. `masks` = false: all is tissue.
PreparedEyes prepare_eyes(StoredPicture left, StoredPicture right, const Rectifier& rectifier,
                          const StereoOptions& options, bool masks = true,
                          const EyeInsets& insets = {});

}  // namespace organbake
