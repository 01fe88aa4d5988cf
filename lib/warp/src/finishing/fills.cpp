// SPDX-License-Identifier: Apache-2.0
// Closes the slits and holes that samples leave open between skin. Beside its border skin fades
// into the background.
#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <span>

#include "finishing/post_process.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

struct SlitFilling {
  CoverMask& bits;
  Frame& frame;
  KeptPixels& kept;
  std::mutex keeping = {};

  std::size_t index(PixelAt at) const { return std::size_t(at.y) * frame.color.width + at.x; }
  // Mixes the pixels between two covered ones, `count` of them.
  void bridge(PixelAt before, PixelAt step, int count) {
    const auto pixel = [&](int i) { return PixelAt{before.x + i * step.x, before.y + i * step.y}; };
    const std::size_t first = index(before), last = index(pixel(count + 1));
    for (int i = 1; i <= count; ++i) {
      const std::size_t at = index(pixel(i));
      {
        const std::lock_guard lock(keeping);
        kept.keep(at, frame);
      }
      for (int c = 0; c < 3; ++c) {
        const int a = frame.color.pixels[3 * first + c], b = frame.color.pixels[3 * last + c];
        const int mixed = (a * (count + 1 - i) + b * i + (count + 1) / 2) / (count + 1);
        frame.color.pixels[3 * at + c] = static_cast<std::uint8_t>(mixed);
      }
      if (!frame.depth_mm.empty()) {
        const float t = static_cast<float>(i) / static_cast<float>(count + 1);
        frame.depth_mm[at] = (1 - t) * frame.depth_mm[first] + t * frame.depth_mm[last];
      }
      frame.cover[at] = Cover::filled;
      bits.close(pixel(i));
    }
  }
  // The slit that ends beside a pixel of skin, if it is one; `back` leads into it.
  void fill(PixelAt end, PixelAt back) {
    int run = 0;
    PixelAt at = end;
    do {
      at = {at.x + back.x, at.y + back.y};
    } while (bits.is_open(at) && ++run <= kWidestSlit);
    if (bits.is_skin(at)) bridge(at, {-back.x, -back.y}, run);
  }
};

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

// No column of pixels depends on another, so that words of them are filled in parallel; then rows,
// likewise.
std::size_t fill_slits(CoverMask& bits, Frame& frame, KeptPixels& kept) {
  const std::size_t before = kept.size();
  SlitFilling slits{bits, frame, kept};
  parallel_for(0, bits.words(), [&](int word) {
    for (int y = bits.box().y0 + 1; y < bits.box().y1; ++y)
      bits.for_each(bits.skin(y)[word] & bits.open(y - 1)[word], word, y, [&](PixelAt end) {
        slits.fill(end, {0, -1});
      });
  });
  constexpr int kGrain = 64;
  parallel_each(bits.box().y0, bits.box().y1, kGrain, [&](int y) {
    for (int word = 0; word < bits.words(); ++word)
      bits.for_each(bits.skin(y)[word] & bits.right_of(bits.open(y), word), word, y,
                    [&](PixelAt end) {
                      slits.fill(end, {-1, 0});
                    });
  });
  return kept.size() - before;
}

// By how much of the pixels round it are covered, under a tent of the fade's width: half of them on
// a straight border, all of them a width away from it. Half and less shows nothing, so that teeth
// narrower than the fade are cut along a smooth curve (level set of a filtered indicator: Merriman,
// Bence, Osher 1992, "Diffusion generated motion by mean curvature"). In whole numbers, as
// graphics hardware counts it, too (fade.frag).
void fade_borders(const PixelBox& box, int width_px, const std::array<std::uint8_t, 3>& background,
                  Frame& frame, KeptPixels& kept) {
  if (width_px < 2 || box.empty()) return;
  const int width = width_px, first_row = box.y0 - width;
  const std::size_t columns = box.width();
  const Sum all = static_cast<Sum>(width * width * width * width);  // of a pixel far from borders
  std::vector<Sum> across(columns * (box.height() + 2 * width));
  parallel_for(0, box.height() + 2 * width, [&](int i) {
    const int y = std::clamp(first_row + i, 0, frame.color.height - 1);
    add_across(frame, box, y, width, std::span(across).subspan(columns * i, columns));
  });
  struct Faded {
    std::size_t at;
    float share;
  };
  std::vector<std::vector<Faded>> by_row(box.height());
  parallel_for(0, box.height(), [&](int i) {
    std::vector<Sum> sums(columns);
    for (int d = 1 - width; d < width; ++d)
      add_weighted(&across[columns * (i + width + d)], static_cast<Sum>(width - std::abs(d)),
                   static_cast<unsigned>(columns), sums.data());
    for (int x = box.x0; x < box.x1; ++x) {
      const std::size_t at = std::size_t(box.y0 + i) * frame.color.width + x;
      const Sum sum = sums[x - box.x0];
      if (sum != all && frame.cover[at] != Cover::background)
        by_row[i].push_back({at, share_of(sum, all)});
    }
  });
  const auto& linear = linear_from_srgb8();
  for (const auto& row : by_row) {
    for (const auto& [at, share] : row) {
      kept.keep(at, frame);
      std::uint8_t* const rgb = &frame.color.pixels[3 * at];
      for (int c = 0; c < 3; ++c)
        rgb[c] = srgb8_from_linear(share * linear[rgb[c]] + (1 - share) * linear[background[c]]);
    }
  }
}

}  // namespace organbake
