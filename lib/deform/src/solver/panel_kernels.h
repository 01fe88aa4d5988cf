// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

// The inner loops of SparseFactor: one panel against right sides kept as rows of floats, four
// lanes to a lot, kLots lots to a row. Double4 beyond kLanes are zero and stay so.
namespace organbake::deform {

using Floats4 [[gnu::vector_size(16), gnu::may_alias, gnu::aligned(4)]] = float;
using Floats8 [[gnu::vector_size(32), gnu::may_alias, gnu::aligned(4)]] = float;

inline constexpr std::size_t kBlockRows = 8;  // rows below a panel come in blocks of so many

struct PanelView {
  std::size_t width = 0, blocks = 0;
  const float* diagonal = nullptr;       // width × width, strictly lower part of the inverse
  const float* below = nullptr;          // blocks of width × kBlockRows, column after column
  const std::uint32_t* index = nullptr;  // of the rows below, kBlockRows to a block
};

template <int kLots>
struct RowOf;
template <>
struct RowOf<1> {
  using Type = Floats4;
};
template <>
struct RowOf<2> {
  using Type = Floats8;
};

inline Floats8 joined(const float* low, const float* high) {
  return __builtin_shufflevector(*reinterpret_cast<const Floats4*>(low),
                                 *reinterpret_cast<const Floats4*>(high), 0, 1, 2, 3, 4, 5, 6, 7);
}
inline void subtract_halves(const Floats8& v, float* low, float* high) {
  *reinterpret_cast<Floats4*>(low) -= __builtin_shufflevector(v, v, 0, 1, 2, 3);
  *reinterpret_cast<Floats4*>(high) -= __builtin_shufflevector(v, v, 4, 5, 6, 7);
}
inline Floats8 even_pairs(const Floats8& a, const Floats8& b) {
  return __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
}
inline Floats8 odd_pairs(const Floats8& a, const Floats8& b) {
  return __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
}
inline Floats8 low_mix(const Floats8& a, const Floats8& b) {
  return __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
}
inline Floats8 high_mix(const Floats8& a, const Floats8& b) {
  return __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
}

// Eight rows of four lanes, one plane of eight to a lane.
template <int kLanes>
[[gnu::always_inline]] inline void gather_planes(const float* rows, std::size_t stride,
                                                 const std::uint32_t* index, Floats8* planes) {
  const auto row = [&](int i) { return rows + index[i] * stride; };
  const Floats8 r04 = joined(row(0), row(4)), r15 = joined(row(1), row(5));
  const Floats8 r26 = joined(row(2), row(6)), r37 = joined(row(3), row(7));
  const Floats8 xy01 = low_mix(r04, r15), xy23 = low_mix(r26, r37);
  const Floats8 zw01 = high_mix(r04, r15), zw23 = high_mix(r26, r37);
  planes[0] = even_pairs(xy01, xy23);
  planes[1] = odd_pairs(xy01, xy23);
  planes[2] = even_pairs(zw01, zw23);
  if constexpr (kLanes == 4) planes[3] = odd_pairs(zw01, zw23);
}

// The way back, taken from the rows.
template <int kLanes>
[[gnu::always_inline]] inline void subtract_planes(const Floats8* planes,
                                                   const std::uint32_t* index, float* rows,
                                                   std::size_t stride) {
  Floats8 last{};
  if constexpr (kLanes == 4) last = planes[3];
  const Floats8 xy01 = low_mix(planes[0], planes[1]), xy23 = high_mix(planes[0], planes[1]);
  const Floats8 zw01 = low_mix(planes[2], last), zw23 = high_mix(planes[2], last);
  const auto row = [&](int i) { return rows + index[i] * stride; };
  subtract_halves(even_pairs(xy01, zw01), row(0), row(4));
  subtract_halves(odd_pairs(xy01, zw01), row(1), row(5));
  subtract_halves(even_pairs(xy23, zw23), row(2), row(6));
  subtract_halves(odd_pairs(xy23, zw23), row(3), row(7));
}

// Each plane's sum, a lane each.
template <int kLanes>
Floats4 sums_of_planes(const Floats8* planes) {
  const auto half = [](const Floats8& v) {
    return __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
  };
  const Floats4 x = half(planes[0]), y = half(planes[1]), z = half(planes[2]);
  Floats4 w{};
  if constexpr (kLanes == 4) w = half(planes[3]);
  const Floats4 xy =
      __builtin_shufflevector(x, y, 0, 4, 1, 5) + __builtin_shufflevector(x, y, 2, 6, 3, 7);
  const Floats4 zw =
      __builtin_shufflevector(z, w, 0, 4, 1, 5) + __builtin_shufflevector(z, w, 2, 6, 3, 7);
  return __builtin_shufflevector(xy, zw, 0, 1, 4, 5) + __builtin_shufflevector(xy, zw, 2, 3, 6, 7);
}

// own += diagonal · own. A product with the block's inverse has no chain of dependent steps, which
// a substitution does.
template <int kLots>
void add_block(const PanelView& panel, float* own) {
  using PaddedVector = typename RowOf<kLots>::Type;
  PaddedVector* row = reinterpret_cast<PaddedVector*>(own);
  for (std::size_t k = panel.width; k-- > 1;) {
    const float* value = panel.diagonal + k * panel.width;
    PaddedVector sum{};
    for (std::size_t q = 0; q < k; ++q) sum += value[q] * row[q];
    row[k] += sum;
  }
}

template <int kLots>
void add_transposed_block(const PanelView& panel, float* own) {
  using PaddedVector = typename RowOf<kLots>::Type;
  PaddedVector* row = reinterpret_cast<PaddedVector*>(own);
  for (std::size_t k = 1; k < panel.width; ++k) {
    const float* value = panel.diagonal + k * panel.width;
    const PaddedVector known = row[k];
    for (std::size_t q = 0; q < k; ++q) row[q] += value[q] * known;
  }
}

// What the rows of kBlocks blocks below the panel lose to its unknowns. Several blocks at once are
// as many sums that don't wait for each other.
template <int kLots, int kLanes, int kBlocks>
void lose_to_panel(const PanelView& panel, std::size_t block, const float* own, float* rows) {
  constexpr std::size_t kStride = std::size_t{4} * kLots;
  const float* value = panel.below + block * panel.width * kBlockRows;
  Floats8 sum[kBlocks][kLots][kLanes] = {};
  for (std::size_t k = 0; k < panel.width; ++k) {
    for (int b = 0; b < kBlocks; ++b) {
      const Floats8 v =
          *reinterpret_cast<const Floats8*>(value + (b * panel.width + k) * kBlockRows);
      for (int lot = 0; lot < kLots; ++lot) {
        for (int lane = 0; lane < kLanes; ++lane)
          sum[b][lot][lane] += v * own[k * kStride + std::size_t{4} * lot + lane];
      }
    }
  }
  for (int b = 0; b < kBlocks; ++b) {
    for (int lot = 0; lot < kLots; ++lot) {
      subtract_planes<kLanes>(sum[b][lot], panel.index + (block + b) * kBlockRows,
                              rows + std::size_t{4} * lot, kStride);
    }
  }
}

// Forward: the panel's own unknowns, then what the rows below lose to them.
template <int kLots, int kLanes>
void eliminate(const PanelView& panel, float* own, float* rows) {
  constexpr int kAtOnce = 4 / kLots;  // as many sums as registers hold
  add_block<kLots>(panel, own);
  std::size_t block = 0;
  for (; block + kAtOnce <= panel.blocks; block += kAtOnce)
    lose_to_panel<kLots, kLanes, kAtOnce>(panel, block, own, rows);
  for (; block < panel.blocks; ++block) lose_to_panel<kLots, kLanes, 1>(panel, block, own, rows);
}

// What kColumns of the panel's unknowns lose to the rows below, which planes hold.
template <int kLots, int kLanes, int kColumns>
void lose_to_below(const PanelView& panel, std::size_t column, const Floats8* planes, float* own) {
  Floats8 sum[kColumns][kLots * kLanes] = {};
  for (std::size_t block = 0; block < panel.blocks; ++block) {
    const float* value = panel.below + (block * panel.width + column) * kBlockRows;
    for (int c = 0; c < kColumns; ++c) {
      const Floats8 v = *reinterpret_cast<const Floats8*>(value + c * kBlockRows);
      for (int lane = 0; lane < kLots * kLanes; ++lane)
        sum[c][lane] += v * planes[block * kLots * kLanes + lane];
    }
  }
  for (int c = 0; c < kColumns; ++c) {
    for (int lot = 0; lot < kLots; ++lot) {
      *reinterpret_cast<Floats4*>(own + (column + c) * 4 * kLots + std::size_t{4} * lot) -=
          sums_of_planes<kLanes>(sum[c] + lot * kLanes);
    }
  }
}

// Backward: the same panel, transposed. planes: room for kLots · kLanes a block.
template <int kLots, int kLanes>
void substitute(const PanelView& panel, float* own, const float* rows, Floats8* planes) {
  for (std::size_t block = 0; block < panel.blocks; ++block) {
    for (int lot = 0; lot < kLots; ++lot)
      gather_planes<kLanes>(rows + std::size_t{4} * lot, std::size_t{4} * kLots,
                            panel.index + block * kBlockRows,
                            planes + (block * kLots + lot) * kLanes);
  }
  constexpr std::size_t kColumns = 4 / kLots;  // as many sums as registers hold
  std::size_t column = 0;
  for (; column + kColumns <= panel.width; column += kColumns)
    lose_to_below<kLots, kLanes, kColumns>(panel, column, planes, own);
  for (; column < panel.width; ++column)
    lose_to_below<kLots, kLanes, 1>(panel, column, planes, own);
  add_transposed_block<kLots>(panel, own);
}

}  // namespace organbake::deform
