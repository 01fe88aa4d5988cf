// SPDX-License-Identifier: Apache-2.0
#include "warp/hole_fill.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "warp/skin_bits.h"

namespace organbake {
namespace {

constexpr int kEnough = 5;

struct Hole {
  std::uint32_t pixel;
  std::array<std::uint8_t, 3> color;
  float depth;
};

// The mean of the covered pixels round an open one, if they are enough.
std::optional<Hole> hole_at(const Frame& frame, PixelAt open) {
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
  if (count < kEnough) return std::nullopt;
  Hole hole{static_cast<std::uint32_t>(open.y * width + open.x), {}, 0};
  for (int k = 0; k < 3; ++k)
    hole.color[k] = static_cast<std::uint8_t>((sum[k] + count / 2) / count);
  hole.depth = depth / static_cast<float>(count);
  return hole;
}

// Open pixels of a word with skin above, below or beside them: no hole has less.
std::uint64_t open_beside_skin(const SkinBits& bits, int word, int y) {
  const std::uint64_t* const skin = bits.skin(y);
  std::uint64_t beside = bits.right_of(skin, word) | bits.left_of(skin, word);
  if (y > bits.box().y0) beside |= bits.skin(y - 1)[word];
  if (y + 1 < bits.box().y1) beside |= bits.skin(y + 1)[word];
  return bits.open(y)[word] & beside;
}

std::vector<Hole> find_holes(const PixelBox& box, const Frame& frame) {
  thread_local SkinBits bits;  // for its memory
  bits.read(box, frame);
  std::vector<Hole> holes;
  for (int y = box.y0; y < box.y1; ++y) {
    for (int word = 0; word < bits.words(); ++word) {
      bits.for_each(open_beside_skin(bits, word, y), word, y, [&](PixelAt open) {
        if (const auto hole = hole_at(frame, open)) holes.push_back(*hole);
      });
    }
  }
  return holes;
}

}  // namespace

HoleCounts fill_holes(const PixelBox& box, bool fill, Frame& frame) {
  HoleCounts counts;
  for (int round = 0; round <= kFillRounds; ++round) {
    const std::vector<Hole> holes = find_holes(box, frame);
    counts.after = holes.size();
    if (round == 0) counts.before = counts.after;
    if (counts.after == 0 || round == kFillRounds || !fill) break;
    for (const Hole& hole : holes) {
      std::copy(hole.color.begin(), hole.color.end(),
                &frame.color.pixels[3 * std::size_t(hole.pixel)]);
      frame.cover[hole.pixel] = Cover::filled;
      if (!frame.depth_mm.empty()) frame.depth_mm[hole.pixel] = hole.depth;
    }
  }
  return counts;
}

}  // namespace organbake
