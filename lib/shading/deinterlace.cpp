// SPDX-License-Identifier: GPL-3.0-or-later
#include "shading/deinterlace.h"

#include <cstdlib>

namespace organbake {

bool is_combed(const Rgb8Image& frame) {
  // A comb: the pixel lies beyond both vertical neighbours, which agree with each other.
  constexpr int kTooth = 12;
  constexpr double kShare = 0.01;
  std::size_t teeth = 0, looked = 0;
  for (int y = 1; y + 2 < frame.height; y += 2)
    for (int x = 0; x < frame.width; x += 4) {
      const int above = frame.at(x, y - 1)[1], here = frame.at(x, y)[1];
      const int below = frame.at(x, y + 1)[1], next = frame.at(x, y + 2)[1];
      ++looked;
      const bool between_fields = std::abs(here - above) > kTooth &&
                                  (here - above) * (here - below) > 0 &&
                                  std::abs(here - below) > kTooth;
      teeth += between_fields && std::abs(above - below) < kTooth / 2 &&
               std::abs(here - next) < kTooth / 2;
    }
  return looked > 0 && teeth > kShare * static_cast<double>(looked);
}

void deinterlace(Rgb8Image& frame) {
  for (int y = 1; y + 1 < frame.height; y += 2)
    for (int x = 0; x < frame.width; ++x)
      for (int c = 0; c < 3; ++c)
        frame.at(x, y)[c] =
            static_cast<std::uint8_t>((frame.at(x, y - 1)[c] + frame.at(x, y + 1)[c] + 1) / 2);
}

}  // namespace organbake
