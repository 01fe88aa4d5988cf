// SPDX-License-Identifier: Apache-2.0
// Holds the frames of a script against the pictures of an earlier run, and fails where the worst of
// them has too low a PSNR.
#include "organbake/player/script.h"

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/image/difference.h"
#include "organbake/image/png.h"

namespace organbake {
namespace fs = std::filesystem;

std::string frame_file_name(int frame) {
  constexpr std::size_t kDigits = 4;
  return "frame_" + padded(static_cast<std::size_t>(frame), kDigits) + ".png";
}

ReferenceFrames::ReferenceFrames(fs::path folder, int frames) : folder_(std::move(folder)) {
  if (!fs::is_directory(folder_)) {
    throw NoInputError(folder_, "is no folder of frames; make one with --script and --out");
  }
  for (int frame = 0; frame < frames; ++frame) {
    if (!fs::exists(folder_ / frame_file_name(frame))) {
      throw BadDataError(folder_, "has no " + frame_file_name(frame) + "; the script has " +
                                      std::to_string(frames) + " frames");
    }
  }
  if (fs::exists(folder_ / frame_file_name(frames))) {
    throw BadDataError(folder_, "has more frames than the script's " + std::to_string(frames));
  }
}

void ReferenceFrames::compare(int frame, const Rgb8Image& picture) {
  const fs::path file = folder_ / frame_file_name(frame);
  const Rgb8Image expected = read_png(file);
  if (expected.width != picture.width || expected.height != picture.height) {
    throw BadDataError(file, "is " + std::to_string(expected.width) + " × " +
                                 std::to_string(expected.height) + ", the script's frames are " +
                                 std::to_string(picture.width) + " × " +
                                 std::to_string(picture.height) + " pixels");
  }
  const double psnr_db = compare_images(picture, expected).psnr_db;
  if (psnr_db < least_psnr_db_) least_psnr_db_ = psnr_db, worst_frame_ = frame;
}

void ReferenceFrames::check(double threshold_db) const {
  if (least_psnr_db_ >= threshold_db) return;
  throw Error(ExitCode::quality_gate, "frame " + std::to_string(worst_frame_) + " differs from " +
                                          (folder_ / frame_file_name(worst_frame_)).string() +
                                          ": PSNR " + to_text(least_psnr_db_, 2) +
                                          " dB, --threshold-db asks for " +
                                          to_text(threshold_db, 2));
}

}  // namespace organbake
