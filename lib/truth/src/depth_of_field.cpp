// SPDX-License-Identifier: Apache-2.0
// Between a few pictures that are blurred as a whole, each pixel by its own depth (Potmesil and
// Chakravarty 1982, in layers): what is sharp spreads a little into what is not, never far, since a
// scope's aperture is some tenths of a millimetre.
#include "depth_of_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "box_blur.h"
#include "organbake/core/median.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

// Of blurred pictures: the boxes' radius, and the deviation of three of them.
struct Level {
  int radius_px;
  float deviation_px;
};
constexpr std::array<Level, 3> kLevels = {{{1, 1.41f}, {3, 3.46f}, {7, 7.48f}}};

// Of the middle third of the picture, each way; 0 where it shows nothing.
float focus_mm(const std::vector<float>& depth_mm, int width, int height) {
  std::vector<float> middle;
  for (int y = height / 3; y < height - height / 3; ++y)
    for (int x = width / 3; x < width - width / 3; ++x)
      if (const float z = depth_mm[std::size_t(y) * width + x]; std::isfinite(z))
        middle.push_back(z);
  return median(std::move(middle));
}

// Where a deviation lies between the levels: 0 is the sharp picture, 1 the first of them.
float level_of(float deviation_px) {
  float below = 0;
  for (std::size_t k = 0; k < kLevels.size(); ++k) {
    const float own = kLevels[k].deviation_px;
    if (deviation_px < own) return static_cast<float>(k) + (deviation_px - below) / (own - below);
    below = own;
  }
  return kLevels.size();
}

// `most`: how many of the blurred pictures take part.
void blur_channel(int channel, const std::vector<float>& levels, std::size_t most,
                  Rgb8Image& picture) {
  const auto& linear = linear_from_srgb8();
  std::array<std::vector<float>, kLevels.size() + 1> pictures;
  std::vector<float>& sharp = pictures[0];
  sharp.resize(levels.size());
  for (std::size_t i = 0; i < sharp.size(); ++i) sharp[i] = linear[picture.pixels[3 * i + channel]];
  for (std::size_t k = 0; k < most; ++k)
    pictures[k + 1] = box_blurred(sharp, picture.width, picture.height, kLevels[k].radius_px);
  parallel_for(0, picture.height, [&](int y) {
    for (std::size_t i = std::size_t(y) * picture.width, end = i + picture.width; i < end; ++i) {
      if (!(levels[i] > 0)) continue;
      const auto below = std::min(static_cast<std::size_t>(levels[i]), most - 1);
      const float share = levels[i] - static_cast<float>(below);
      picture.pixels[3 * i + channel] =
          srgb8_from_linear((1 - share) * pictures[below][i] + share * pictures[below + 1][i]);
    }
  });
}

}  // namespace

void blur_out_of_focus(double aperture_mm, double focal_px, const std::vector<float>& depth_mm,
                       Rgb8Image& picture) {
  constexpr float kDeviation = 0.25f, kSharp_px = 0.35f;  // of a disc's width; below is not seen
  if (!(aperture_mm > 0)) return;
  const float focus = focus_mm(depth_mm, picture.width, picture.height);
  if (!(focus > 0)) return;
  const auto disc = static_cast<float>(focal_px * aperture_mm);
  std::vector<float> levels(depth_mm.size());
  for (std::size_t i = 0; i < levels.size(); ++i)
    levels[i] = level_of(
        std::max(0.0f, kDeviation * disc * std::abs(1 / depth_mm[i] - 1 / focus) - kSharp_px));
  const float highest = *std::max_element(levels.begin(), levels.end());
  if (!(highest > 0)) return;
  const auto most = static_cast<std::size_t>(std::ceil(highest));
  for (int c = 0; c < 3; ++c) blur_channel(c, levels, most, picture);
}

}  // namespace organbake
