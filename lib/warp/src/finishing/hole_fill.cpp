// SPDX-License-Identifier: Apache-2.0
#include "finishing/hole_fill.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr int kEnough = 5;
constexpr int kHoleRows = 32;  // that are looked through at once

struct Hole {
  PixelAt pixel;
  std::array<std::uint8_t, 3> color;
  float depth;
};

// The mean of the covered pixels round an open one.
Hole hole_at(const Frame& frame, PixelAt open) {
  std::array<int, 3> sum{};
  int count = 0;
  float depth = 0;
  const auto width = static_cast<std::size_t>(frame.color.width);
  for (int y = std::max(0, open.y - 1); y <= std::min(frame.color.height - 1, open.y + 1); ++y) {
    for (int x = std::max(0, open.x - 1); x <= std::min(frame.color.width - 1, open.x + 1); ++x) {
      if (!frame.covered(x, y)) continue;
      for (int k = 0; k < 3; ++k) sum[k] += frame.color.at(x, y)[k];
      if (!frame.depth_mm.empty()) depth += frame.depth_mm[y * width + x];
      ++count;
    }
  }
  Hole hole{open, {}, 0};
  for (int k = 0; k < 3; ++k)
    hole.color[k] = static_cast<std::uint8_t>((sum[k] + count / 2) / count);
  hole.depth = depth / static_cast<float>(count);
  return hole;
}

std::uint64_t majority(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return (a & b) | (c & (a | b));
}

// A row's pixels beside those of a word: numbers of two bits.
struct Beside {
  std::uint64_t ones = 0, twos = 0;
};
Beside all_three(const CoverMask& bits, int word, int y) {
  if (y < bits.box().y0 || y >= bits.box().y1) return {};
  const std::uint64_t* const skin = bits.skin(y);
  const std::uint64_t a = bits.right_of(skin, word), b = skin[word], c = bits.left_of(skin, word);
  return {a ^ b ^ c, majority(a, b, c)};
}
Beside both_sides(const CoverMask& bits, int word, int y) {
  const std::uint64_t* const skin = bits.skin(y);
  const std::uint64_t a = bits.right_of(skin, word), b = bits.left_of(skin, word);
  return {a ^ b, a & b};
}

// Open pixels of a word with enough skin round them. All are counted at once: a full adder a bit.
std::uint64_t holes_of_word(const CoverMask& bits, int word, int y) {
  static_assert(kEnough == 5);
  const std::uint64_t open = bits.open(y)[word];
  if (open == 0) return 0;
  const Beside above = all_three(bits, word, y - 1), here = both_sides(bits, word, y),
               below = all_three(bits, word, y + 1);
  const std::uint64_t ones = above.ones ^ here.ones ^ below.ones;
  const std::uint64_t carried = majority(above.ones, here.ones, below.ones);
  const std::uint64_t two_twos = majority(above.twos, here.twos, below.twos);
  const std::uint64_t any_two = above.twos | here.twos | below.twos;
  const std::uint64_t all_twos = above.twos & here.twos & below.twos;
  const std::uint64_t at_least_4 = two_twos | (any_two & carried);
  const std::uint64_t at_least_6 = all_twos | (two_twos & carried);
  return open & (at_least_6 | (at_least_4 & ones));
}

std::vector<Hole> find_holes(const CoverMask& bits, const Frame& frame) {
  const PixelBox& box = bits.box();
  std::vector<std::vector<Hole>> of_rows((std::max(0, box.height()) + kHoleRows - 1) / kHoleRows);
  parallel_for(0, static_cast<int>(of_rows.size()), [&](int rows) {
    const int first = box.y0 + rows * kHoleRows;
    for (int y = first; y < std::min(first + kHoleRows, box.y1); ++y) {
      for (int word = 0; word < bits.words(); ++word) {
        bits.for_each(holes_of_word(bits, word, y), word, y,
                      [&](PixelAt open) { of_rows[rows].push_back(hole_at(frame, open)); });
      }
    }
  });
  std::vector<Hole> holes;
  for (const auto& more : of_rows) holes.insert(holes.end(), more.begin(), more.end());
  return holes;
}

}  // namespace

HoleCounts fill_holes(CoverMask& bits, bool fill, Frame& frame) {
  HoleCounts counts;
  for (int round = 0; round <= kFillRounds; ++round) {
    const std::vector<Hole> holes = find_holes(bits, frame);
    counts.after = holes.size();
    if (round == 0) counts.before = counts.after;
    if (counts.after == 0 || round == kFillRounds || !fill) break;
    for (const Hole& hole : holes) {
      const std::size_t at = std::size_t(hole.pixel.y) * frame.color.width + hole.pixel.x;
      std::copy(hole.color.begin(), hole.color.end(), &frame.color.pixels[3 * at]);
      frame.cover[at] = Cover::filled;
      if (!frame.depth_mm.empty()) frame.depth_mm[at] = hole.depth;
      bits.close(hole.pixel);
    }
  }
  return counts;
}

}  // namespace organbake
