// SPDX-License-Identifier: GPL-3.0-or-later
// Videos are decoded in a module of their own (lib/shading/video), loaded with the first of them.
//   Of a clip's frames those that are worth shading are chosen: each n-th, or the sharpest of n,
// without duplicates. In: a path, or frames. Out: frames in order, one in memory at a time.
#include <string>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/prepared_frame.h"
#include "video_module.h"

namespace organbake {
VideoReader::VideoReader(const std::filesystem::path& path) {
  static const auto open = reinterpret_cast<decltype(&organbake_open_video)>(
      module_door("organbake_video", "organbake_open_video"));
  decoder_.reset(open(path));
}
VideoReader::~VideoReader() = default;
VideoReader::VideoReader(VideoReader&&) noexcept = default;

bool VideoReader::next(StoredPicture& frame) { return decoder_->next(frame); }
std::size_t VideoReader::frames_read() const { return decoder_->frames_read(); }

void SelectionOptions::check() const {
  if (every < 1) throw UsageError("every is " + std::to_string(every) + "; it must be at least 1");
  if (!(duplicate >= 0 && duplicate <= 255))
    throw UsageError("duplicate is " + to_text(duplicate) + "; it must be in 0…255");
}

FrameSelection::FrameSelection(NextFrame next, const SelectionOptions& options)
    : next_(std::move(next)), options_(options) {
  options_.check();
}

bool FrameSelection::read(StoredPicture& image) {
  if (ended_) return false;
  try {
    ended_ = !next_(image);
  } catch (const BadDataError& error) {
    damage_ = error.what();
    ended_ = true;
  }
  read_ += !ended_;
  return !ended_;
}

std::optional<SelectedFrame> FrameSelection::next() {
  while (true) {
    std::optional<SelectedFrame> best;
    StoredPicture image;
    for (int i = 0; i < options_.every && read(image); ++i) {
      if (best && !options_.sharpest) continue;
      const double value = options_.sharpest ? sharpness(image.color) : 0;
      if (best) ++blurred_;
      if (!best || value > best->sharpness)
        best = SelectedFrame{read_ - 1, {}, std::move(image), value, 0};
    }
    if (!best) return std::nullopt;
    best->difference = mean_difference(best->image.color, last_);
    if (best->difference < options_.duplicate) {
      ++duplicates_;
      continue;
    }
    if (!options_.sharpest) best->sharpness = sharpness(best->image.color);
    last_ = best->image.color;
    constexpr std::size_t kDigits = 6;
    best->name = best->image.name.empty() ? padded(best->index, kDigits) : best->image.name;
    return best;
  }
}

}  // namespace organbake
