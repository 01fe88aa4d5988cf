// SPDX-License-Identifier: Apache-2.0
#include "drawing/open_pixels.h"

#include "drawing/tile_keys.h"

namespace organbake {
namespace {

// One bit per cell that no sample has taken, in a form that vectorises.
std::uint64_t empty_cells(const std::uint64_t* __restrict keys,
                          const std::uint64_t* __restrict bit) {
  std::uint64_t word = 0;
  for (int i = 0; i < 64; ++i) word |= keys[i] == kEmptyKey ? bit[i] : 0;
  return word;
}

}  // namespace

// Bits first … last−1 of a row.
OpenPixels::Row OpenPixels::bits_between(int first, int last) {
  const auto below = [](int bit) {  // all bits lower than `bit`
    return bit <= 0 ? 0 : bit >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bit) - 1;
  };
  Row row;
  for (int w = 0; w < kWords; ++w) row[w] = below(last - 64 * w) & ~below(first - 64 * w);
  return row;
}

void OpenPixels::find(const PixelBox& tile, std::span<const TileKeys* const> layers) {
  tile_ = tile;
  alignas(32) std::array<std::uint64_t, 64> bit;
  for (int i = 0; i < 64; ++i) bit[i] = std::uint64_t{1} << i;
  for (int y = tile.y0; y < tile.y1; ++y) {
    Row& row = rows_[y - tile.y0];
    row = bits_between(0, tile.width());
    // Whole words: the guard band is there to be read, and its bits are not wanted.
    for (const TileKeys* layer : layers) {
      for (int w = 0; w < kWords; ++w) {
        if (row[w] != 0) row[w] &= empty_cells(layer->row(y) + 64 * w, bit.data());
      }
    }
  }
}

bool OpenPixels::any(const PixelBox& box) const {
  const int x0 = std::max(box.x0, tile_.x0), x1 = std::min(box.x1, tile_.x1);
  if (x0 >= x1) return false;
  const Row wanted = bits_between(x0 - tile_.x0, x1 - tile_.x0);
  const int y1 = std::min(box.y1, tile_.y1);
  for (int y = std::max(box.y0, tile_.y0); y < y1; ++y) {
    const Row& row = rows_[y - tile_.y0];
    std::uint64_t found = 0;
    for (int w = 0; w < kWords; ++w) found |= row[w] & wanted[w];
    if (found) return true;
  }
  return false;
}

}  // namespace organbake
