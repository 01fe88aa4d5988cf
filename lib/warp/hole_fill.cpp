// SPDX-License-Identifier: Apache-2.0
#include "warp/hole_fill.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace organbake {
namespace {

constexpr int kEnough = 5;

struct Hole {
  std::uint32_t pixel;
  std::array<std::uint8_t, 3> color;
  float depth;
};

// covered[i] counts the covered pixels of a column of three; rows off the picture count as open.
void count_columns(const Frame& frame, int y, std::vector<std::uint8_t>& columns) {
  const int width = frame.color.width;
  std::fill(columns.begin(), columns.end(), std::uint8_t{0});
  for (int row = std::max(0, y - 1); row <= std::min(frame.color.height - 1, y + 1); ++row) {
    const Cover* cover = &frame.cover[std::size_t(row) * width];
    std::uint8_t* out = columns.data() + 1;
    for (int x = 0; x < width; ++x) out[x] += cover[x] != Cover::background;
  }
}

void mix_neighbours(const Frame& frame, int x, int y, Hole& hole) {
  std::array<int, 3> sum{};
  int count = 0;
  float depth = 0;
  for (int ny = std::max(0, y - 1); ny <= std::min(frame.color.height - 1, y + 1); ++ny) {
    for (int nx = std::max(0, x - 1); nx <= std::min(frame.color.width - 1, x + 1); ++nx) {
      if (!frame.covered(nx, ny)) continue;
      for (int k = 0; k < 3; ++k) sum[k] += frame.color.at(nx, ny)[k];
      if (!frame.depth_mm.empty())
        depth += frame.depth_mm[std::size_t(ny) * frame.color.width + nx];
      ++count;
    }
  }
  for (int k = 0; k < 3; ++k)
    hole.color[k] = static_cast<std::uint8_t>((sum[k] + count / 2) / count);
  hole.depth = depth / static_cast<float>(count);
}

void find_in_row(const Frame& frame, const PixelBox& box, int y, std::vector<Hole>& holes) {
  thread_local std::vector<std::uint8_t> columns;
  const int width = frame.color.width;
  columns.resize(std::size_t(width) + 2);
  count_columns(frame, y, columns);
  const Cover* cover = &frame.cover[std::size_t(y) * width];
  constexpr int kBlock = 64;
  for (int x0 = box.x0; x0 < box.x1; x0 += kBlock) {
    const int x1 = std::min(x0 + kBlock, box.x1);
    std::uint8_t any = 0;  // holes are rare: look at whole blocks first, in bytes
    for (int x = x0; x < x1; ++x) {
      const auto around = static_cast<std::uint8_t>(columns[x] + columns[x + 1] + columns[x + 2]);
      any |= static_cast<std::uint8_t>(cover[x] == Cover::background) &
             static_cast<std::uint8_t>(around >= kEnough);
    }
    if (!any) continue;
    for (int x = x0; x < x1; ++x) {
      const unsigned around = unsigned(columns[x]) + columns[x + 1] + columns[x + 2];
      if (cover[x] != Cover::background || around < kEnough) continue;
      Hole hole{static_cast<std::uint32_t>(std::size_t(y) * width + x), {}, 0};
      mix_neighbours(frame, x, y, hole);
      holes.push_back(hole);
    }
  }
}

std::vector<std::vector<Hole>> find_holes(const Frame& frame, const PixelBox& box) {
  std::vector<std::vector<Hole>> by_row(box.height());
  tbb::parallel_for(tbb::blocked_range<int>(box.y0, box.y1, 32),
                    [&](const tbb::blocked_range<int>& rows) {
                      for (int y = rows.begin(); y < rows.end(); ++y) {
                        find_in_row(frame, box, y, by_row[y - box.y0]);
                      }
                    });
  return by_row;
}

}  // namespace

HoleCounts fill_holes(const PixelBox& box, bool fill, Frame& frame) {
  HoleCounts counts;
  for (int round = 0; round <= kFillRounds; ++round) {
    const auto by_row = find_holes(frame, box);
    counts.after = 0;
    for (const auto& row : by_row) counts.after += row.size();
    if (round == 0) counts.before = counts.after;
    if (counts.after == 0 || round == kFillRounds || !fill) break;
    for (const auto& row : by_row) {
      for (const Hole& hole : row) {
        std::copy(hole.color.begin(), hole.color.end(),
                  &frame.color.pixels[3 * std::size_t(hole.pixel)]);
        frame.cover[hole.pixel] = Cover::filled;
        if (!frame.depth_mm.empty()) frame.depth_mm[hole.pixel] = hole.depth;
      }
    }
  }
  return counts;
}

}  // namespace organbake
