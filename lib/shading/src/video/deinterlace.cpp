// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/frame_preparation.h"

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

void deinterlace(StoredPicture& frame) {
  const int height = frame.color.height;
  const std::size_t row = 3 * std::size_t(frame.color.width);
  for (int y = 1; y + 1 < height; y += 2) {
    std::uint8_t* here = frame.color.at(0, y);
    for (std::size_t i = 0; i < row; ++i)
      here[i] = static_cast<std::uint8_t>((*(here + i - row) + here[i + row] + 1) / 2);
    if (frame.linear.empty()) continue;
    float* light = &frame.linear[row * static_cast<std::size_t>(y)];
    for (std::size_t i = 0; i < row; ++i) light[i] = 0.5F * (*(light + i - row) + light[i + row]);
  }
}

}  // namespace organbake
