// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <limits>
#include <string>

#include "organbake/image/channel_image.h"

namespace organbake {

// "frame_0000.png": what a script's frames are called.
std::string frame_file_name(int frame);

// The pictures of an earlier run, frame_0000.png and so on, that a script's frames are held
// against.
class ReferenceFrames {
 public:
  // Throws NoInputError without the folder, BadDataError unless it holds pictures for exactly
  // `frames` frames.
  ReferenceFrames(std::filesystem::path folder, int frames);

  // Throws BadDataError for a picture that cannot be read or has another size.
  void compare(int frame, const Rgb8Image& picture);

  // Of the frames compared; +inf when all are equal.
  double least_psnr_db() const { return least_psnr_db_; }
  int worst_frame() const { return worst_frame_; }
  // Throws Error (quality gate) when a frame's PSNR is below the threshold.
  void check(double threshold_db) const;

 private:
  std::filesystem::path folder_;
  double least_psnr_db_ = std::numeric_limits<double>::infinity();
  int worst_frame_ = 0;
};

}  // namespace organbake
