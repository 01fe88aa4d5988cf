// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

struct VideoFormat {
  int width = 0, height = 0;
  double frames_per_second = 25;
  double megabits_per_second = 0;  // 0 = as ffmpeg sees fit
};

// Sends raw frames to an ffmpeg process, which writes the video under a temporary name; finish()
// renames it into place. Without finish() nothing is left. The same frames give the same bytes on
// any number of cores.
class VideoPipe {
 public:
  // Of the containers that it can write: ".mp4" and so on.
  static std::vector<std::string> endings();

  // Throws UsageError for another ending, IoError when ffmpeg is not installed or cannot start.
  VideoPipe(const std::filesystem::path& file, const VideoFormat& format);
  ~VideoPipe();
  VideoPipe(const VideoPipe&) = delete;
  VideoPipe& operator=(const VideoPipe&) = delete;

  void add(const Rgb8Image& frame);
  void finish();

 private:
  int wait();

  std::filesystem::path file_, temporary_;
  int input_ = -1;
  pid_t process_ = -1;
};

}  // namespace organbake
