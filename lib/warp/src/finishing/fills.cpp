// SPDX-License-Identifier: Apache-2.0
// Closes what samples leave open: holes in skin, and slits between two pieces of it. Beside its
// border skin fades into the background.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "finishing/post_process.h"
#include "organbake/bundle/lighting.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "picture/spans.h"

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

// By how much of the pixels round it are covered, under a tent of the fade's width: half of them on
// a straight border, all of them a width away from it. Half and less shows nothing, so that teeth
// narrower than the fade are cut along a smooth curve (level set of a filtered indicator: Merriman,
// Bence, Osher 1992, "Diffusion generated motion by mean curvature"). In whole numbers, as
// graphics hardware counts it, too (fade.frag).
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
