// SPDX-License-Identifier: Apache-2.0
#include "samples/texel_order.h"

#include <algorithm>
#include <bit>

#include "organbake/warp/draw_options.h"
#include "samples/sample_set.h"

namespace organbake {
namespace {

constexpr int kTile = 8;
constexpr int kMostSpan = 16;  // texels; keeps one patch's plane close to its samples

std::uint32_t every_second_bit(std::uint32_t code) {
  code &= 0x55555555u;
  code = (code | code >> 1) & 0x33333333u;
  code = (code | code >> 2) & 0x0F0F0F0Fu;
  code = (code | code >> 4) & 0x00FF00FFu;
  return (code | code >> 8) & 0x0000FFFFu;
}

bool used(const CameraMaps& maps, std::size_t texel) {
  return maps.face[texel] != kNoFace && maps.confidence[texel] >= kLeastConfidence;
}

// Calls visit(texel) for every texel in use, tile by tile along the Morton curve.
template <class Visit>
void along_curve(const CameraMaps& maps, Visit&& visit) {
  const int columns = (maps.width + kTile - 1) / kTile, rows = (maps.height + kTile - 1) / kTile;
  const std::uint32_t side = std::bit_ceil(static_cast<std::uint32_t>(std::max(columns, rows)));
  for (std::uint64_t code = 0; code < std::uint64_t(side) * side; ++code) {
    const int column = every_second_bit(static_cast<std::uint32_t>(code));
    const int row = every_second_bit(static_cast<std::uint32_t>(code >> 1));
    if (column >= columns || row >= rows) continue;
    const int last_x = std::min(kTile * (column + 1), maps.width);
    const int last_y = std::min(kTile * (row + 1), maps.height);
    for (int y = kTile * row; y < last_y; ++y) {
      for (int x = kTile * column; x < last_x; ++x) {
        const std::size_t texel = std::size_t(y) * maps.width + x;
        if (used(maps, texel)) visit(static_cast<std::uint32_t>(texel));
      }
    }
  }
}

struct MapBox {
  int min_x = 1 << 30, max_x = -1, min_y = 1 << 30, max_y = -1;
  void add(int x, int y) {
    min_x = std::min(min_x, x), max_x = std::max(max_x, x);
    min_y = std::min(min_y, y), max_y = std::max(max_y, y);
  }
  MapBox joined(const MapBox& other) const {
    return {std::min(min_x, other.min_x), std::max(max_x, other.max_x),
            std::min(min_y, other.min_y), std::max(max_y, other.max_y)};
  }
  bool compact() const { return max_x - min_x < kMostSpan && max_y - min_y < kMostSpan; }
};

// One face's texels, which come tile after tile, become runs: whole tiles are never torn apart,
// small pieces of neighbouring tiles share a run.
void cut_face(const TexelOrder& order, int width, std::uint32_t face, std::uint32_t begin,
              std::uint32_t end, std::vector<TexelRun>& runs) {
  const auto tile_of = [&](std::uint32_t i) {
    const std::uint32_t x = order.texels[i] % width, y = order.texels[i] / width;
    return std::uint64_t(y / kTile) << 32 | x / kTile;
  };
  TexelRun run{face, begin, 0};
  MapBox run_box;
  for (std::uint32_t i = begin; i < end;) {
    MapBox piece_box;
    std::uint32_t next = i;
    for (const std::uint64_t tile = tile_of(i); next < end && tile_of(next) == tile; ++next) {
      piece_box.add(order.texels[next] % width, order.texels[next] / width);
    }
    const MapBox together = run_box.joined(piece_box);
    if (run.count > 0 && (run.count + (next - i) > kChunk || !together.compact())) {
      runs.push_back(run);
      run = {face, i, 0};
      run_box = piece_box;
    } else {
      run_box = together;
    }
    run.count += next - i;
    i = next;
  }
  if (run.count > 0) runs.push_back(run);
}

}  // namespace

TexelOrder order_texels(const CameraMaps& maps) {
  std::uint32_t faces = 0;
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    if (used(maps, i)) faces = std::max(faces, maps.face[i] + 1);
  }
  std::vector<std::uint32_t> start(faces + 1, 0);
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    if (used(maps, i)) ++start[maps.face[i] + 1];
  }
  for (std::uint32_t f = 0; f < faces; ++f) start[f + 1] += start[f];

  TexelOrder order;
  order.texels.resize(start.back());
  std::vector<std::uint32_t> next(start.begin(), start.end() - (faces > 0 ? 1 : 0));
  along_curve(maps, [&](std::uint32_t texel) { order.texels[next[maps.face[texel]]++] = texel; });
  for (std::uint32_t f = 0; f < faces; ++f) {
    cut_face(order, maps.width, f, start[f], start[f + 1], order.runs);
  }
  return order;
}

}  // namespace organbake
