// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "disparity.h"
#include "organbake/shading/local_pattern.h"

namespace organbake {

std::vector<EyeImage> eye_pyramid(const Rgb8Image& color, const Mask& counts, int longest_px) {
  Plane grey = grey_levels(color);
  Mask used = counts;
  std::vector<EyeImage> levels = {{local_pattern(grey, used), used}};
  while (std::max(grey.width, grey.height) > longest_px) {
    halve_counted(grey, used);
    levels.push_back({local_pattern(grey, used), used});
  }
  return levels;
}

}  // namespace organbake
