// SPDX-License-Identifier: Apache-2.0
// By how much of the pixels round it are covered, under a tent of the fade's width: half of them on
// a straight border, all of them a width away from it. Half and less shows nothing, so that teeth
// narrower than the fade are cut along a smooth curve (level set of a filtered indicator: Merriman,
// Bence, Osher 1992, "Diffusion generated motion by mean curvature"). In whole numbers, as
// graphics hardware counts it, too (fade.frag).
#include "finishing/border_fade.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <span>

#include "organbake/bundle/lighting.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "picture/vector_loops.h"

namespace organbake {
namespace {

using Sum = std::uint16_t;
static_assert(SkinFinish::kWidestFade_px * SkinFinish::kWidestFade_px <= 255);  // squared: a Sum

ORGANBAKE_MULTIVERSION void add_weighted(const Sum* __restrict values, Sum weight, unsigned count,
                                         Sum* __restrict sums) {
  for (unsigned i = 0; i < count; ++i) sums[i] = static_cast<Sum>(sums[i] + weight * values[i]);
}

// Of the box's columns in a row: covered pixels beside each, width² where all are. What lies beyond
// the picture is as the picture's last pixel.
void add_across(const Frame& frame, const PixelBox& box, int y, int width, std::span<Sum> sums) {
  const Cover* const row = frame.cover.data() + std::size_t(y) * frame.color.width;
  std::vector<Sum> covered(box.width() + 2 * width);
  const int first = box.x0 - width;  // column of the first of them
  const int from = std::max(0, first), to = std::min(frame.color.width, box.x1 + width);
  const auto end = std::transform(row + from, row + to, covered.begin() + (from - first),
                                  [](Cover cover) { return Sum{cover != Cover::background}; });
  std::fill(covered.begin(), covered.begin() + (from - first), covered[from - first]);
  std::fill(end, covered.end(), *(end - 1));
  for (int d = 1 - width; d < width; ++d)
    add_weighted(covered.data() + width + d, static_cast<Sum>(width - std::abs(d)), box.width(),
                 sums.data());
}

// How much of a pixel stays.
float share_of(Sum sum, Sum all) {
  const float t = std::max(0.0f, static_cast<float>(2 * sum - all) / static_cast<float>(all));
  return t * t * (3 - 2 * t);
}

}  // namespace

void BorderFade::apply(const PixelBox& box, int width_px,
                       const std::array<std::uint8_t, 3>& background, Frame& frame) {
  faded_.clear();
  if (width_px < 2 || box.empty()) return;
  const int width = width_px, first_row = box.y0 - width;
  const std::size_t columns = box.width();
  const Sum all = static_cast<Sum>(width * width * width * width);  // of a pixel far from borders
  std::vector<Sum> across(columns * (box.height() + 2 * width));
  parallel_for(0, box.height() + 2 * width, [&](int i) {
    const int y = std::clamp(first_row + i, 0, frame.color.height - 1);
    add_across(frame, box, y, width, std::span(across).subspan(columns * i, columns));
  });
  const auto& linear = linear_from_srgb8();
  std::vector<std::vector<Pixel>> by_row(box.height());
  parallel_for(0, box.height(), [&](int i) {
    std::vector<Sum> sums(columns);
    for (int d = 1 - width; d < width; ++d)
      add_weighted(&across[columns * (i + width + d)], static_cast<Sum>(width - std::abs(d)),
                   static_cast<unsigned>(columns), sums.data());
    for (int x = box.x0; x < box.x1; ++x) {
      const std::size_t at = std::size_t(box.y0 + i) * frame.color.width + x;
      const Sum sum = sums[x - box.x0];
      if (sum == all || frame.cover[at] == Cover::background) continue;
      const float share = share_of(sum, all);
      std::uint8_t* const rgb = &frame.color.pixels[3 * at];
      by_row[i].push_back({static_cast<std::uint32_t>(at), {rgb[0], rgb[1], rgb[2]}});
      for (int c = 0; c < 3; ++c)
        rgb[c] = srgb8_from_linear(share * linear[rgb[c]] + (1 - share) * linear[background[c]]);
    }
  });
  for (const auto& row : by_row) faded_.insert(faded_.end(), row.begin(), row.end());
}

void BorderFade::undo(Frame& frame) const {
  for (const Pixel& pixel : faded_)
    std::copy(pixel.before.begin(), pixel.before.end(),
              &frame.color.pixels[3 * std::size_t{pixel.at}]);
}

}  // namespace organbake
