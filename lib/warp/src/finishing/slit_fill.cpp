// SPDX-License-Identifier: Apache-2.0
#include "finishing/slit_fill.h"

#include <atomic>
#include <cstdint>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

struct Step {
  int x, y;
};

// Mixes the pixels between two covered ones, `count` of them.
void bridge(PixelAt before, Step step, int count, CoverMask& bits, Frame& frame) {
  const auto pixel = [&](int i) { return PixelAt{before.x + i * step.x, before.y + i * step.y}; };
  const auto index = [&](PixelAt at) { return std::size_t(at.y) * frame.color.width + at.x; };
  const std::size_t first = index(before), last = index(pixel(count + 1));
  for (int i = 1; i <= count; ++i) {
    const std::size_t at = index(pixel(i));
    for (int c = 0; c < 3; ++c) {
      const int a = frame.color.pixels[3 * first + c], b = frame.color.pixels[3 * last + c];
      frame.color.pixels[3 * at + c] =
          static_cast<std::uint8_t>((a * (count + 1 - i) + b * i + (count + 1) / 2) / (count + 1));
    }
    if (!frame.depth_mm.empty()) {
      const float t = static_cast<float>(i) / static_cast<float>(count + 1);
      frame.depth_mm[at] = (1 - t) * frame.depth_mm[first] + t * frame.depth_mm[last];
    }
    frame.cover[at] = Cover::filled;
    bits.close(pixel(i));
  }
}

// Fills the slit that ends beside a pixel of skin; `back` leads into it. Returns its pixels, 0 when
// it is none.
int fill_slit(CoverMask& bits, PixelAt end, Step back, bool fill, Frame& frame) {
  int run = 0;
  PixelAt at = end;
  do {
    at = {at.x + back.x, at.y + back.y};
  } while (bits.is_open(at) && ++run <= kWidestSlit);
  if (!bits.is_skin(at)) return 0;
  if (fill) bridge(at, {-back.x, -back.y}, run, bits, frame);
  return run;
}

// Columns know nothing of each other: a word's are filled at once with other words'.
std::size_t fill_columns(CoverMask& bits, bool fill, Frame& frame) {
  std::atomic<std::size_t> pixels = 0;
  parallel_for(0, bits.words(), [&](int word) {
    for (int y = bits.box().y0 + 1; y < bits.box().y1; ++y) {
      bits.for_each(bits.skin(y)[word] & bits.open(y - 1)[word], word, y, [&](PixelAt end) {
        pixels += fill_slit(bits, end, {0, -1}, fill, frame);
      });
    }
  });
  return pixels;
}

// Nor do rows.
std::size_t fill_rows(CoverMask& bits, bool fill, Frame& frame) {
  constexpr int kGrain = 64;
  std::atomic<std::size_t> pixels = 0;
  parallel_pieces(bits.box().y0, bits.box().y1, kGrain, [&](int y, int last) {
    for (; y < last; ++y) {
      for (int word = 0; word < bits.words(); ++word) {
        const std::uint64_t ends = bits.skin(y)[word] & bits.right_of(bits.open(y), word);
        bits.for_each(ends, word, y, [&](PixelAt end) {
          pixels += fill_slit(bits, end, {-1, 0}, fill, frame);
        });
      }
    }
  });
  return pixels;
}

}  // namespace

std::size_t fill_slits(CoverMask& bits, bool fill, Frame& frame) {
  const std::size_t of_columns = fill_columns(bits, fill, frame);
  return of_columns + fill_rows(bits, fill, frame);
}

}  // namespace organbake
