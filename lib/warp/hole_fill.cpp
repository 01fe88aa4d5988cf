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

// Counts the covered pixels of each column of three rows.
void count_columns(const Cover* __restrict above, const Cover* __restrict here,
                   const Cover* __restrict below, int width, std::uint8_t* __restrict columns) {
  for (int x = 0; x < width; ++x) {
    const std::uint8_t a = above[x] != Cover::background, b = here[x] != Cover::background,
                       c = below[x] != Cover::background;
    columns[x] = static_cast<std::uint8_t>(a + b + c);
  }
}

// Whether any pixel of a stretch is a hole; columns[0] belongs to the one before the first.
bool any_hole(const Cover* __restrict cover, const std::uint8_t* __restrict columns, int width) {
  std::uint8_t any = 0;
  for (int x = 0; x < width; ++x) {
    const auto around = static_cast<std::uint8_t>(columns[x] + columns[x + 1] + columns[x + 2]);
    const std::uint8_t open = cover[x] == Cover::background, enough = around >= kEnough;
    any |= static_cast<std::uint8_t>(open & enough);
  }
  return any != 0;
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
  const int width = frame.color.width;
  // Beyond the picture everything is open.
  thread_local std::vector<std::uint8_t> columns;
  thread_local std::vector<Cover> outside;  // never written to
  columns.resize(std::size_t(width) + 2);
  columns.front() = columns.back() = 0;
  outside.resize(width, Cover::background);
  const auto row = [&](int at) {
    const bool inside = at >= 0 && at < frame.color.height;
    return inside ? &frame.cover[std::size_t(at) * width] : outside.data();
  };
  const int first = std::max(0, box.x0 - 1), last = std::min(width, box.x1 + 1);
  count_columns(row(y - 1) + first, row(y) + first, row(y + 1) + first, last - first,
                columns.data() + 1 + first);
  const Cover* const cover = row(y);
  constexpr int kBlock = 64;
  for (int x0 = box.x0; x0 < box.x1; x0 += kBlock) {
    const int x1 = std::min(x0 + kBlock, box.x1);
    // Holes are rare: whole blocks are looked at first.
    if (!any_hole(cover + x0, columns.data() + x0, x1 - x0)) continue;
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
