// SPDX-License-Identifier: GPL-3.0-or-later
#include "stereo/eye_order.h"

#include <algorithm>

namespace organbake {
namespace {

double matched(const EyeImage& left, const EyeImage& right, const DisparityRange& range) {
  const Disparity found = match_eyes(left, right, range);
  const auto count = [](const Mask& mask) {
    return static_cast<double>(mask.size()) -
           static_cast<double>(std::count(mask.values.begin(), mask.values.end(), 0));
  };
  return count(found.known) / std::max(1.0, count(left.counts));
}

}  // namespace

bool swapped(const EyeImage& left, const EyeImage& right, const DisparityRange& range,
             double matched_share) {
  constexpr double kWell = 0.6, kLeast = 0.4, kTimesBetter = 1.5;
  if (matched_share >= kWell) return false;
  const double other_way = matched(right, left, range);
  return other_way > kLeast && other_way > kTimesBetter * matched(left, right, range);
}

}  // namespace organbake
