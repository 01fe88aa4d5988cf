// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/usable_pixels.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "organbake/shading/cv_grid.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

// Features at the rim are of the stop, not of tissue: their window reaches over it.
constexpr int kRim = 80;  // of the width one such part

double share_of(const Mask& mask) {
  return static_cast<double>(cv::countNonZero(cv_view(mask))) /
         static_cast<double>(std::max<std::size_t>(1, mask.size()));
}

}  // namespace

void UsablePixels::look_for_what_is_slow(const Rgb8Image& half) {
  field_ = field_of_view(half, 2);
  const std::optional<Mask> found = find_instruments(half, field_);
  colourless_ = !found;
  const Mask instruments = found.value_or(Mask(half.width, half.height));
  instruments_now_ = share_of(instruments);
  instruments_sum_ += instruments_now_;
  ++looked_;
  slow_ = without(eroded(field_, std::max(2, half.width / kRim)), dilated(instruments, 4));
}

Mask UsablePixels::next(const Rgb8Image& frame) {
  const Rgb8Image half = half_size(frame);
  if (count_++ % look_every_ == 0) look_for_what_is_slow(half);
  const Mask usable = without(slow_, dilated(find_highlights(half, field_), 2));
  Mask full(frame.width, frame.height);
  cv::Mat target = cv_view(full);
  cv::resize(cv_view(usable), target, target.size(), 0, 0, cv::INTER_NEAREST);
  return full;
}

}  // namespace organbake
