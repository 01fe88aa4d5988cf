// SPDX-License-Identifier: Apache-2.0
#include "warp/see_through.h"
#include "warp/wide.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

namespace organbake {
namespace {

constexpr int kReachPx = 2;   // how far to either side
constexpr int kBlock = 2048;  // columns at a time: most pictures' rows as one stream
constexpr float kInfinity = std::numeric_limits<float>::infinity();

inline float nearer(float a, float b) { return a < b ? a : b; }
inline float farther(float a, float b) { return a > b ? a : b; }

// Depths of a stretch of a row, +inf where nothing covers; off the picture, too.
struct Stretch {
  alignas(32) std::array<float, kBlock + 2 * kReachPx> depth;

  void load(const Frame& frame, const std::vector<float>& depth_mm, int x0, int x1, int y) {
    const bool outside = y < 0 || y >= frame.color.height;
    const int first = std::max(0, x0 - kReachPx), last = std::min(frame.color.width, x1 + kReachPx);
    if (outside || first > x0 - kReachPx || last < x1 + kReachPx) depth.fill(kInfinity);
    if (outside) return;
    const std::size_t at = std::size_t(y) * frame.color.width + first;
    const auto* const cover = reinterpret_cast<const std::uint8_t*>(&frame.cover[at]);
    const float* const from = &depth_mm[at];
    float* const to = depth.data() + (first - (x0 - kReachPx));
    // The row below is asked for next: each lies in pages of its own, which no prefetcher enters.
    constexpr int kLine = 64 / sizeof(float);  // of a cache's
    for (int i = 0; y + 1 < frame.color.height && i < last - first; i += kLine)
      __builtin_prefetch(from + frame.color.width + i);
    for (int i = 0; i < last - first; ++i) to[i] = cover[i] ? from[i] : kInfinity;
  }
  const float* at(int x) const { return depth.data() + kReachPx + x; }
};

// Looks at one row of a block; rows: the five round it.
ORGANBAKE_WIDE void find_in_block(const std::array<Stretch*, 5>& rows, int width, float deeper_mm,
                                  std::size_t first_pixel, std::vector<std::uint32_t>& found) {
  alignas(32) std::array<std::uint8_t, kBlock> through;
  std::uint8_t any = 0;
  const float* const here = rows[2]->at(0);
  const float *const above = rows[1]->at(0), *const above2 = rows[0]->at(0);
  const float *const below = rows[3]->at(0), *const below2 = rows[4]->at(0);
  for (int x = 0; x < width; ++x) {
    const float sides = farther(nearer(here[x - 1], here[x - 2]), nearer(here[x + 1], here[x + 2]));
    const float ends = farther(nearer(above[x], above2[x]), nearer(below[x], below2[x]));
    // False for an uncovered pixel: +inf is not less than +inf, and not a depth to be opened.
    through[x] = (nearer(sides, ends) + deeper_mm < here[x]) & (here[x] < kInfinity);
    any |= through[x];
  }
  for (int x = 0; any && x < width; ++x) {
    if (through[x]) found.push_back(static_cast<std::uint32_t>(first_pixel + x));
  }
}

}  // namespace

std::vector<std::uint32_t> find_see_through(const PixelBox& box, const std::vector<float>& depth_mm,
                                            float deeper_mm, const Frame& frame) {
  if (box.empty()) return {};
  std::vector<std::vector<std::uint32_t>> found(box.height());
  constexpr int kRows = 32;
  tbb::parallel_for(tbb::blocked_range<int>(box.y0, box.y1, kRows), [&](const auto& range) {
    for (int x0 = box.x0; x0 < box.x1; x0 += kBlock) {
      const int x1 = std::min(x0 + kBlock, box.x1);
      std::array<Stretch, 5> stretches;
      std::array<Stretch*, 5> rows;  // a window that slides down
      for (int i = 0; i < 5; ++i) rows[i] = &stretches[i];
      for (int i = 0; i < 4; ++i) rows[i + 1]->load(frame, depth_mm, x0, x1, range.begin() - 2 + i);
      for (int y = range.begin(); y < range.end(); ++y) {
        std::rotate(rows.begin(), rows.begin() + 1, rows.end());
        rows[4]->load(frame, depth_mm, x0, x1, y + 2);
        find_in_block(rows, x1 - x0, deeper_mm, std::size_t(y) * frame.color.width + x0,
                      found[y - box.y0]);
      }
    }
  });
  std::vector<std::uint32_t> all;
  for (const auto& row : found) all.insert(all.end(), row.begin(), row.end());
  std::sort(all.begin(), all.end());  // a row was looked at in blocks
  return all;
}

}  // namespace organbake
