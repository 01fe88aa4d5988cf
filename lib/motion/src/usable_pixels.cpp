// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/usable_pixels.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "organbake/shading/cv_grid.h"
#include "organbake/shading/insets.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

// Features at the rim are of the stop, not of tissue: their window reaches over it.
constexpr int kRim = 80;  // of the width one such part

constexpr int kAway_px = 4;  // from what moves otherwise than tissue, at half size

Mask at_size(const Mask& mask, int width, int height) {
  Mask resized(width, height);
  cv::Mat target = cv_view(resized);
  cv::resize(cv_view(mask), target, target.size(), 0, 0, cv::INTER_NEAREST);
  return resized;
}

}  // namespace

UsablePixels::UsablePixels(std::size_t look_every, const Mask& insets) : look_every_(look_every) {
  if (insets.size() > 0)
    insets_ = at_size(insets, std::max(1, insets.width / 2), std::max(1, insets.height / 2));
}

void UsablePixels::look_for_what_is_slow(const Rgb8Image& half) {
  field_ = field_of_view(half, 2);
  if (insets_.size() > 0) field_ = without(std::move(field_), insets_);
  const std::optional<Mask> found = find_instruments(half, field_);
  colourless_ = !found;
  const Mask instruments = found.value_or(Mask(half.width, half.height));
  instruments_now_ = share_of(instruments);
  instruments_sum_ += instruments_now_;
  ++looked_;
  slow_ = without(eroded(field_, std::max(2, half.width / kRim)), dilated(instruments, kAway_px));
  if (insets_.size() > 0) slow_ = without(std::move(slow_), dilated(insets_, kAway_px));
}

Mask UsablePixels::next(const Rgb8Image& frame) {
  const Rgb8Image half = half_size(frame);
  if (count_++ % look_every_ == 0) look_for_what_is_slow(half);
  const Mask usable = without(slow_, dilated(find_highlights(half, field_), 2));
  return at_size(usable, frame.width, frame.height);
}

}  // namespace organbake
