// SPDX-License-Identifier: GPL-3.0-or-later
// The door of the module organbake_video, which alone links libav: with all that it loads in turn
// it is two thirds of the libraries of a stage that may read a video, and most clips are folders.
#pragma once

#include <cstddef>
#include <filesystem>

#include "organbake/image/picture.h"

namespace organbake {

// As VideoReader says.
class VideoDecoder {
 public:
  virtual ~VideoDecoder() = default;
  virtual bool next(StoredPicture& frame) = 0;
  virtual std::size_t frames_read() const = 0;
};

}  // namespace organbake

extern "C" {
// The caller's to delete.
__attribute__((visibility("default"))) organbake::VideoDecoder* organbake_open_video(
    const std::filesystem::path& path);
}
