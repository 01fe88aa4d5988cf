// SPDX-License-Identifier: Apache-2.0
#include "finishing/see_through.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

using Level = SkinDepth::Level;

constexpr int kDepthBlock =
    1024;  // columns at a time: five rows of them stay in the first-level cache
static_assert(SkinDepth::kMargin >= 2);  // how far to either side is looked

inline Level nearer(Level a, Level b) { return a < b ? a : b; }
inline Level farther(Level a, Level b) { return a > b ? a : b; }

using Flags = std::array<Level, kDepthBlock>;

// Looks at whole vectors of a row; rows: the five round it. Returns whether any pixel is found.
ORGANBAKE_MULTIVERSION bool look_through(const std::array<const Level*, 5>& rows, int width,
                                         Level deeper, Flags& __restrict through) {
  const Level *const above2 = rows[0], *const above = rows[1], *const here = rows[2],
                     *const below = rows[3], *const below2 = rows[4];
  Level any = 0;
  // Twice as many levels as other numbers to a vector.
  const int count =
      static_cast<int>((static_cast<unsigned>(width) + 2 * kLanes - 1) & ~(2 * kLanes - 1));
  ORGANBAKE_LANES(8)
  for (int x = 0; x < count; ++x) {
    const Level sides = farther(nearer(here[x - 1], here[x - 2]), nearer(here[x + 1], here[x + 2]));
    const Level ends = farther(nearer(above[x], above2[x]), nearer(below[x], below2[x]));
    const Level before = static_cast<Level>(farther(here[x], deeper) - deeper);
    // Where nothing is shown there is nothing to be opened.
    through[x] = (nearer(sides, ends) < before) & (here[x] != SkinDepth::kNothing);
    any |= through[x];
  }
  return any != 0;
}

void find_in_row(const PixelBox& box, int y, const SkinDepth& depth, Level deeper,
                 std::vector<std::uint32_t>& found) {
  alignas(64) Flags through;
  for (int x0 = box.x0; x0 < box.x1; x0 += kDepthBlock) {
    const int width = std::min(kDepthBlock, box.x1 - x0);
    std::array<const Level*, 5> rows;
    for (int i = 0; i < 5; ++i) rows[i] = depth.row(y + i - 2) + x0;
    constexpr int kLine = 64 / sizeof(Level);  // of a cache's
    const Level* const next = depth.row(std::min(y + 4, depth.height() + 1)) + x0;
    for (int i = 0; i < width; i += kLine) __builtin_prefetch(next + i);
    if (!look_through(rows, width, deeper, through)) continue;
    for (int x = 0; x < width; ++x) {
      if (through[x]) found.push_back(static_cast<std::uint32_t>(y * depth.width() + x0 + x));
    }
  }
}

}  // namespace

std::vector<std::uint32_t> find_see_through(const PixelBox& box, const SkinDepth& depth,
                                            float deeper_mm) {
  if (box.empty()) return {};
  const float levels = std::min(deeper_mm / depth.level_mm(), float{SkinDepth::kFarthest});
  const auto deeper = static_cast<Level>(std::lround(levels));
  constexpr int kRows = 32;  // at once
  std::vector<std::vector<std::uint32_t>> found((box.height() + kRows - 1) / kRows);
  parallel_for(0, static_cast<int>(found.size()), [&](int rows) {
    const int first = box.y0 + rows * kRows;
    for (int y = first; y < std::min(first + kRows, box.y1); ++y)
      find_in_row(box, y, depth, deeper, found[rows]);
  });
  std::vector<std::uint32_t> all;
  for (const auto& rows : found) all.insert(all.end(), rows.begin(), rows.end());
  return all;
}

}  // namespace organbake
