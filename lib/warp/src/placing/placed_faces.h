// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/warp/view.h"
#include "placing/posed_shell.h"
#include "samples/patch.h"

namespace organbake {

// A shell matrix, each column in a register of its own: the fourth row is zero.
using ShellColumns = Eigen::Matrix<float, 4, 9>;

// One face of the shell's surface in one frame: its deformed shell matrix in the view's frame, in
// millimetres and multiplied by the intrinsics, so that a sample of a flat face lands with 15
// multiply-adds and one reciprocal.
struct FaceFrame {
  ShellColumns metric;     // camera millimetres
  ShellColumns pixel;      // pixel × depth, pixel × depth, depth
  bool bent = false;       // the last three columns are not zero
  bool two_sided = false;  // see PosedShell
};

// All faces of the shell in one frame, and which of them moved since the last.
class PlacedFaces {
 public:
  // continued: the last placing was of the same shell for the same view, and its frame is gone on
  // with. Faces that stayed are not placed anew.
  void place(const PosedShell& shell, const View& view, bool continued);
  // Faces that look otherwise although they stayed where they were: set in `changed`, by face.
  void add_moved(std::span<const std::uint8_t> changed);

  std::size_t size() const { return frames_.size(); }
  const FaceFrame& operator[](std::size_t face) const { return frames_[face]; }
  std::span<const FaceFrame> all() const { return frames_; }
  // Whether only what moved is to be drawn, and whether a face did.
  bool continued() const { return continued_; }
  bool moved(std::size_t face) const { return !continued_ || moved_[face] != 0; }
  // Whether one of some patches' faces did.
  bool any_moved(const PatchTable& patches, std::size_t first, std::size_t last) const {
    for (; first < last; ++first)
      if (moved(patches.face(first))) return true;
    return false;
  }

 private:
  std::vector<FaceFrame> frames_;
  std::vector<std::uint32_t> revisions_;  // of the faces as they are placed
  std::vector<std::uint8_t> moved_;
  bool continued_ = false;
};

}  // namespace organbake
