// SPDX-License-Identifier: Apache-2.0
// Where skin ends in a picture, in bits: which pixels it covers, between which neighbours the
// nearer skin ends, and which look through skin at what lies behind.
#include "finishing/post_process.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr int kWord = CoverMask::kWord;
constexpr int kRowGrain = 64, kEdgeGrain = 32;  // rows of a piece

using Level = SkinDepth::Level;

using Flags64 = std::array<std::uint8_t, kWord>;  // each 0 or 1

// One bit for each, eight at once: the product moves bit 8k to 56 + k. (A loop over vectors sets
// flags, which the compiler would turn into bits one by one.)
std::uint64_t bits_of(const Flags64& flags) {
  std::uint64_t bits = 0;
  for (int i = 0; i < kWord; i += 8) {
    std::uint64_t eight;
    std::memcpy(&eight, &flags[i], sizeof eight);
    bits |= (eight * 0x0102040810204080u >> 56) << i;
  }
  return bits;
}

// One bit for each of 64 covers that are `wanted`.
std::uint64_t bits_of(const Cover* covers, Cover wanted) {
  Flags64 flags;
  for (int i = 0; i < kWord; ++i) flags[i] = covers[i] == wanted;
  return bits_of(flags);
}

// One bit for each of 64 pairs of levels that are more than `most` apart.
std::uint64_t apart(const Level* levels, const Level* others, Level most) {
  Flags64 flags;
  for (int i = 0; i < kWord; ++i) {
    const Level a = levels[i], b = others[i];
    flags[i] = static_cast<Level>(a > b ? a - b : b - a) > most;
  }
  return bits_of(flags);
}

// Levels along a line of four pixels, the pair in the middle. Whether one surface ends between
// them: a slope goes on at least on one side.
bool is_step(int before, int first, int second, int after) {
  if (first > second) std::swap(before, after), std::swap(first, second);
  // One pixel of the farther surface before the background does not tell: mostly it is the last of
  // the nearer one.
  if (second == SkinDepth::kNothing || after == SkinDepth::kNothing) return false;
  const int step = second - first, back = std::abs(after - second);
  const int front = before == SkinDepth::kNothing ? 0 : std::abs(first - before);
  // Towards its own outline the nearer surface falls ever faster; what lies behind does not.
  constexpr int kBack = 3;
  return step > front && step > kBack * back;
}

// Columns at a time: five rows of them stay in the first-level cache.
constexpr int kDepthBlock = 1024;
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

void CoverMask::read(const PixelBox& within, const Frame& frame) {
  const PixelBox picture{0, 0, frame.color.width, frame.color.height};
  box_ = within.empty()
             ? PixelBox()
             : intersected({within.x0 - 1, within.y0 - 1, within.x1 + 1, within.y1 + 1}, picture);
  words_ = (box_.width() + kWord - 1) / kWord;
  const std::size_t words = std::size_t(words_) * box_.height();
  skin_.resize(words);
  open_.resize(words);
  parallel_each(box_.y0, box_.y1, kRowGrain, [&](int y) {
    std::size_t at = std::size_t(y - box_.y0) * words_;
    const Cover* const row = &frame.cover[std::size_t(y) * frame.color.width];
    for (int x = box_.x0; x < box_.x1; x += kWord) {
      const int count = std::min(kWord, box_.x1 - x);
      std::array<Cover, kWord> beside{};  // beyond the box: tools, which are neither skin nor open
      if (count < kWord)
        std::fill(std::copy_n(row + x, count, beside.begin()), beside.end(), Cover::solid);
      const Cover* const covers = count < kWord ? beside.data() : row + x;
      const std::uint64_t open = bits_of(covers, Cover::background);
      open_[at] = open;
      skin_[at++] = ~(open | bits_of(covers, Cover::solid));
    }
  });
}

// Each row has bits of its own.
void FrontEdges::find(const CoverMask& skin, const SkinDepth* depth, float deeper_mm) {
  skin_ = &skin;
  const PixelBox& box = skin.box();
  const std::size_t words = skin.words(), all = words * box.height();
  for (auto& planes : planes_)
    for (auto& plane : planes) plane.resize(all);
  const Level deeper = depth ? std::max(Level{1}, depth->levels(deeper_mm)) : Level{0};
  parallel_each(box.y0, box.y1, kEdgeGrain, [&](int y) {
    find_borders(y);
    if (depth) find_steps(*depth, deeper, row, y);
    if (depth && y + 1 < box.y1) find_steps(*depth, deeper, column, y);
  });
}

// Of the background.
void FrontEdges::find_borders(int y) {
  const CoverMask& skin = *skin_;
  const std::size_t at = std::size_t(y - skin.box().y0) * skin.words();
  const bool last = y + 1 == skin.box().y1;
  for (int word = 0; word < skin.words(); ++word) {
    const std::uint64_t here = skin.skin(y)[word], open = skin.open(y)[word];
    planes_[row][first][at + word] = here & skin.left_of(skin.open(y), word);
    planes_[row][second][at + word] = open & skin.left_of(skin.skin(y), word);
    planes_[column][first][at + word] = last ? 0 : here & skin.open(y + 1)[word];
    planes_[column][second][at + word] = last ? 0 : open & skin.skin(y + 1)[word];
  }
}

void FrontEdges::find_steps(const SkinDepth& depth, Level deeper, Along along, int y) {
  const PixelBox& box = skin_->box();
  const std::size_t at = std::size_t(y - box.y0) * skin_->words();
  // Along the line on which the pair lies: the pixels before, of and after it.
  const auto levels = [&](int i) {
    return (along == row ? depth.row(y) + i : depth.row(y + i)) + box.x0;
  };
  const std::array line = {levels(-1), levels(0), levels(1), levels(2)};
  for (int word = 0; word < skin_->words(); ++word) {
    const std::uint64_t* const here = skin_->skin(y);
    const std::uint64_t both =
        here[word] & (along == row ? skin_->left_of(here, word) : skin_->skin(y + 1)[word]);
    if (both == 0) continue;
    const int x0 = word * kWord;
    for (std::uint64_t bits = both & apart(line[1] + x0, line[2] + x0, deeper); bits != 0;
         bits &= bits - 1) {
      const int bit = std::countr_zero(bits), x = x0 + bit;
      if (!is_step(line[0][x], line[1][x], line[2][x], line[3][x])) continue;
      planes_[along][line[1][x] < line[2][x] ? first : second][at + word] |= std::uint64_t{1}
                                                                             << bit;
    }
  }
}

bool FrontEdges::in_front(PixelAt pixel, PixelAt other) const {
  const Along along = pixel.y == other.y ? row : column;
  return other.x > pixel.x || other.y > pixel.y ? has(along, first, pixel)
                                                : has(along, second, other);
}

std::vector<std::uint32_t> find_see_through(const PixelBox& box, const SkinDepth& depth,
                                            float deeper_mm) {
  if (box.empty()) return {};
  const Level deeper = depth.levels(deeper_mm);
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
