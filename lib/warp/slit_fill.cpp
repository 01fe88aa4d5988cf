// SPDX-License-Identifier: Apache-2.0
#include "warp/slit_fill.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>

namespace organbake {
namespace {

constexpr int kLanes = 64;  // columns side by side: one cache line of a row

// Mixes the pixels between two covered ones, `step` apart, `count` of them.
void bridge(std::size_t before, std::size_t step, int count, Frame& frame) {
  const std::size_t after = before + step * (count + 1);
  for (int i = 1; i <= count; ++i) {
    const std::size_t at = before + step * i;
    for (int c = 0; c < 3; ++c) {
      const int a = frame.color.pixels[3 * before + c], b = frame.color.pixels[3 * after + c];
      frame.color.pixels[3 * at + c] =
          static_cast<std::uint8_t>((a * (count + 1 - i) + b * i + (count + 1) / 2) / (count + 1));
    }
    if (!frame.depth_mm.empty()) {
      const float t = static_cast<float>(i) / static_cast<float>(count + 1);
      frame.depth_mm[at] = (1 - t) * frame.depth_mm[before] + t * frame.depth_mm[after];
    }
    frame.cover[at] = Cover::filled;
  }
}

// Runs of uncovered pixels above each column of a strip; far off the picture at its top.
std::size_t fill_columns(const PixelBox& strip, bool fill, Frame& frame) {
  const std::size_t width = frame.color.width;
  std::array<std::uint8_t, kLanes> run;
  run.fill(255);
  std::size_t pixels = 0;
  for (int y = strip.y0; y < strip.y1; ++y) {
    const Cover* cover = &frame.cover[y * width + strip.x0];
    std::array<std::uint8_t, kLanes> ends;
    std::uint8_t any =
        0;  // slits are rare: a row is looked at in bytes, lane by lane only if need be
    for (int x = 0; x < strip.width(); ++x) {
      const bool covered = cover[x] != Cover::background;
      ends[x] = covered && run[x] >= 1 && run[x] <= kWidestSlit ? run[x] : 0;
      any |= ends[x];
      run[x] = covered ? 0 : static_cast<std::uint8_t>(run[x] + (run[x] < 255));
    }
    for (int x = 0; any && x < strip.width(); ++x) {
      if (ends[x] == 0) continue;
      pixels += ends[x];
      if (fill) bridge((y - ends[x] - 1) * width + strip.x0 + x, width, ends[x], frame);
    }
  }
  return pixels;
}

std::size_t fill_row(const PixelBox& box, int y, bool fill, Frame& frame) {
  const std::size_t row = std::size_t(y) * frame.color.width;
  const auto* const cover = reinterpret_cast<const std::uint8_t*>(frame.cover.data()) + row;
  std::size_t pixels = 0;
  const auto covered = [&](int x) { return frame.cover[row + x] != Cover::background; };
  int x = box.x0;
  while (x < box.x1 && !covered(x)) ++x;
  while (x < box.x1) {
    // Almost all of a row is covered without a break: let the library find the next one.
    const void* open = std::memchr(cover + x, static_cast<int>(Cover::background), box.x1 - x);
    if (!open) break;
    const int first = static_cast<int>(static_cast<const std::uint8_t*>(open) - cover);
    x = first;
    while (x < box.x1 && !covered(x)) ++x;
    const int run = x - first;
    if (x == box.x1 || run > kWidestSlit) continue;
    pixels += run;
    if (fill) bridge(row + first - 1, 1, run, frame);
  }
  return pixels;
}

}  // namespace

std::size_t fill_slits(const PixelBox& box, bool fill, Frame& frame) {
  std::atomic<std::size_t> pixels{0};
  const int strips = (box.width() + kLanes - 1) / kLanes;
  tbb::parallel_for(0, strips, [&](int s) {
    const int x0 = box.x0 + s * kLanes;
    pixels += fill_columns({x0, box.y0, std::min(x0 + kLanes, box.x1), box.y1}, fill, frame);
  });
  tbb::parallel_for(tbb::blocked_range<int>(box.y0, box.y1, 32),
                    [&](const tbb::blocked_range<int>& rows) {
                      for (int y = rows.begin(); y < rows.end(); ++y) {
                        pixels += fill_row(box, y, fill, frame);
                      }
                    });
  return pixels;
}

}  // namespace organbake
