// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>

#include "organbake/image/picture.h"

namespace organbake {

// Frames of a video, front to back. A file's frame count is never asked: frames come until they
// end.
class VideoReader {
 public:
  // Throws NoInputError, or BadDataError when it is no video that can be decoded.
  explicit VideoReader(const std::filesystem::path& path);
  ~VideoReader();
  VideoReader(VideoReader&&) noexcept;

  // The frame as it is stored, with its turn (of the display matrix) and its pixels' aspect. False
  // after the last frame. Throws BadDataError that names the frame (counted from 0): damaged
  // or missing data, another size than the frames before, light that is not coded
  // as screens show it (linear, logarithmic, PQ, HLG), no frame at all.
  [[nodiscard]] bool next(StoredPicture& frame);
  std::size_t frames_read() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
