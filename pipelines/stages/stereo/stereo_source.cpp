// SPDX-License-Identifier: GPL-3.0-or-later
// Opens the two eyes of a clip, in one file or two, with their calibration.
#include "stages/stereo/stereo_source.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "stages/shared/clip_source.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Next = FrameSelection::NextFrame;

std::string text_of(const Rgb8Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

Rgb8Image part(const Rgb8Image& image, int left, int top, int width, int height) {
  Rgb8Image cut(width, height);
  for (int y = 0; y < height; ++y)
    std::copy_n(image.at(left, top + y), 3 * std::size_t(width), cut.at(0, y));
  return cut;
}

StoredPicture beside(const Rgb8Image& left, const Rgb8Image& right, std::string name) {
  Rgb8Image both(left.width + right.width, left.height);
  for (int y = 0; y < both.height; ++y) {
    std::copy_n(left.at(0, y), 3 * std::size_t(left.width), both.at(0, y));
    std::copy_n(right.at(0, y), 3 * std::size_t(right.width), both.at(left.width, y));
  }
  StoredPicture picture(std::move(both));
  picture.name = std::move(name);
  return picture;
}

// The first picture of a clip, and the clip with it.
StoredPicture look_ahead(Next& next, const fs::path& path) {
  auto first = std::make_shared<StoredPicture>();
  if (!next(*first)) throw BadDataError(path, "holds no frame");
  StoredPicture seen = *first;
  next = [first, others = std::move(next)](StoredPicture& picture) mutable {
    if (!first) return others(picture);
    picture = std::move(*first);
    first = nullptr;
    return true;
  };
  return seen;
}

// Whether the frames of two videos stay of one time. Where they begin tells nothing: recorders do
// not start together.
class Clocks {
 public:
  // Throws BadDataError from the frame on at which they are half a frame apart.
  void check(std::size_t frame, const StoredPicture& left, const StoredPicture& right) {
    if (!std::isfinite(left.time_s) || !std::isfinite(right.time_s)) return;
    if (frame == 0) ahead_s_ = left.time_s - right.time_s;
    const double drift_s = left.time_s - right.time_s - ahead_s_;
    if (frame > 0 && std::abs(drift_s) > 0.5 * (left.time_s - last_left_s_))
      throw BadDataError("frame " + std::to_string(frame) + ": the left eye's is of " +
                         to_text(left.time_s, 3) + " s, the right eye's of " +
                         to_text(right.time_s, 3) +
                         " s: the videos drift apart in time; bring both to one frame rate, and "
                         "put missing frames in");
    last_left_s_ = left.time_s;
  }

 private:
  double ahead_s_ = 0, last_left_s_ = 0;
};

Next two_clips(Next left, Next right) {
  return [left = std::move(left), right = std::move(right), clocks = Clocks(),
          at = std::size_t{0}](StoredPicture& both) mutable {
    StoredPicture a, b;
    const bool more_left = left(a), more_right = right(b);
    if (more_left != more_right)
      throw BadDataError("frame " + std::to_string(at) + ": the " + (more_left ? "right" : "left") +
                         " eye's clip has ended and the other goes on; do they belong together?");
    if (!more_left) return false;
    clocks.check(at, a, b);
    both = beside(a.color, b.color, a.name);
    ++at;
    return true;
  };
}

StereoLayout layout_of(const StoredPicture& first, const StereoStageOptions& options,
                       const fs::path& path) {
  const StereoLayout layout =
      options.layout == StereoLayout::none ? find_stereo_layout(first.color) : options.layout;
  if (layout == StereoLayout::none)
    throw BadDataError(path,
                       "holds one picture in a frame, not two like ones side by side or one above "
                       "the other: give the right eye's file as well, or say --layout");
  return layout;
}

Next one_clip(Next next, StereoLayout layout) {
  return [next = std::move(next), layout](StoredPicture& both) mutable {
    StoredPicture frame;
    if (!next(frame)) return false;
    const int width = frame.color.width, height = frame.color.height;
    if (layout == StereoLayout::side_by_side) {
      const int half = width / 2;
      both = beside(part(frame.color, 0, 0, half, height),
                    part(frame.color, width - half, 0, half, height), frame.name);
    } else {
      const int half = height / 2;
      both = beside(part(frame.color, 0, 0, width, half),
                    part(frame.color, 0, height - half, width, half), frame.name);
    }
    return true;
  };
}

Next changed_places(Next next) {
  return [next = std::move(next)](StoredPicture& both) mutable {
    if (!next(both)) return false;
    both = beside(right_of(both).color, left_of(both).color, both.name);
    return true;
  };
}

}  // namespace

EyeSource open_eyes(const fs::path& left, const fs::path* right, const StereoStageOptions& options,
                    const RunContext& context) {
  EyeSource source{open_frames(left, nullptr, context).next,
                   {},
                   left.filename().string(),
                   right ? right->filename().string() : left.filename().string()};
  const StoredPicture first = look_ahead(source.next, left);
  source.eye = {first.color.width, first.color.height};
  if (right) {
    Next other = open_frames(*right, nullptr, context).next;
    const StoredPicture second = look_ahead(other, *right);
    if (second.color.width != first.color.width || second.color.height != first.color.height)
      throw BadDataError(*right, "is " + text_of(second.color) + ", the left eye's picture " +
                                     text_of(first.color) + "; the eyes must be of one size");
    source.next = two_clips(std::move(source.next), std::move(other));
  } else {
    const StereoLayout layout = layout_of(first, options, left);
    (layout == StereoLayout::side_by_side ? source.eye.width : source.eye.height) /= 2;
    source.next = one_clip(std::move(source.next), layout);
  }
  if (options.swap_eyes) source.next = changed_places(std::move(source.next));
  return source;
}

StoredPicture left_of(const StoredPicture& both) {
  return part(both.color, 0, 0, both.color.width / 2, both.color.height);
}

StoredPicture right_of(const StoredPicture& both) {
  const int half = both.color.width / 2;
  return part(both.color, half, 0, half, both.color.height);
}

}  // namespace organbake
