// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "organbake/image/picture.h"

namespace organbake {

class VideoDecoder;

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
  std::unique_ptr<VideoDecoder> decoder_;
};

struct SelectionOptions {
  int every = 1;          // of each `every` frames one is taken: the first, or
  bool sharpest = false;  // the sharpest of them
  // A frame that differs less than this from the one taken before (mean, of 255) is a duplicate.
  double duplicate = 0.05;

  void check() const;  // throws UsageError
};

struct SelectedFrame {
  std::size_t index = 0;  // in the clip, from 0
  std::string name;       // of its file without the ending; of a video the index in six digits
  StoredPicture image;
  double sharpness = 0;
  double difference = 0;  // from the frame taken before
};

// The frames of a clip that are worth shading, in order, one in memory at a time.
class FrameSelection {
 public:
  // Puts the next frame of the clip into the argument; false after the last; throws BadDataError
  // that names the frame.
  using NextFrame = std::function<bool(StoredPicture&)>;

  FrameSelection(NextFrame next, const SelectionOptions& options);

  // Nothing after the last frame, or after a damaged one: damage() then says which and why.
  [[nodiscard]] std::optional<SelectedFrame> next();
  const std::string& damage() const { return damage_; }
  std::size_t frames_read() const { return read_; }
  std::size_t duplicates() const { return duplicates_; }
  std::size_t blurred() const { return blurred_; }  // passed over for a sharper neighbour

 private:
  bool read(StoredPicture& image);

  NextFrame next_;
  SelectionOptions options_;
  Rgb8Image last_;
  std::size_t read_ = 0, duplicates_ = 0, blurred_ = 0;
  bool ended_ = false;
  std::string damage_;
};

}  // namespace organbake
