// SPDX-License-Identifier: GPL-3.0-or-later
#include "light/linear_color.h"

#include "organbake/image/srgb.h"

namespace organbake {

LinearColor linear_color(const Rgb8Image& frame) {
  LinearColor linear;
  for (int c = 0; c < 3; ++c) {
    linear[c] = Plane(frame.width, frame.height);
    for (std::size_t k = 0; k < linear[c].size(); ++k)
      linear[c].values[k] = linear_from_srgb8()[frame.pixels[3 * k + c]];
  }
  return linear;
}

}  // namespace organbake
