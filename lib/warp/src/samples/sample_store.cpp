// SPDX-License-Identifier: Apache-2.0
// From a bundle's maps to samples that are kept: in which order texels come, what has to fit, and
// when a camera's are made.
#include <algorithm>
#include <bit>
#include <cstring>
#include <exception>
#include <mutex>
#include <numeric>
#include <string>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/warp/draw_options.h"
#include "picture/spans.h"
#include "samples/samples.h"

namespace organbake {
namespace {

constexpr int kTile = 8;  // a power of two, and a row of it a word of bytes
static_assert(kTile == sizeof(std::uint64_t) && std::endian::native == std::endian::little);
constexpr int kMostSpan = 16;  // texels; keeps one patch's plane close to its samples

std::uint32_t every_second_bit(std::uint32_t code) {
  code &= 0x55555555u;
  code = (code | code >> 1) & 0x33333333u;
  code = (code | code >> 2) & 0x0F0F0F0Fu;
  code = (code | code >> 4) & 0x00FF00FFu;
  return (code | code >> 8) & 0x0000FFFFu;
}

// By texel, whether it is in use. Beyond the last, a tile's row can be read.
std::vector<std::uint8_t> texels_in_use(const CameraMaps& maps) {
  std::vector<std::uint8_t> used(maps.face.size() + kTile);
  for (std::size_t i = 0; i < maps.face.size(); ++i)
    used[i] = (maps.face[i] != kNoFace) & (maps.confidence[i] >= kLeastConfidence);
  return used;
}

// The texels in use, tile by tile along the Morton curve.
std::vector<std::uint32_t> along_curve(const CameraMaps& maps) {
  const std::vector<std::uint8_t> used = texels_in_use(maps);
  std::vector<std::uint32_t> texels;
  texels.reserve(static_cast<std::size_t>(std::count(used.begin(), used.end(), 1)));
  const int columns = (maps.width + kTile - 1) / kTile, rows = (maps.height + kTile - 1) / kTile;
  const std::uint32_t side = std::bit_ceil(static_cast<std::uint32_t>(std::max(columns, rows)));
  for (std::uint64_t code = 0; code < std::uint64_t(side) * side; ++code) {
    const int column = every_second_bit(static_cast<std::uint32_t>(code));
    const int row = every_second_bit(static_cast<std::uint32_t>(code >> 1));
    if (column >= columns || row >= rows) continue;
    const int beyond = std::max(0, kTile * (column + 1) - maps.width);  // of the tile's columns
    const int last_y = std::min(kTile * (row + 1), maps.height);
    for (int y = kTile * row; y < last_y; ++y) {
      const std::size_t first = std::size_t(y) * maps.width + kTile * column;
      std::uint64_t of_row;  // a byte each
      std::memcpy(&of_row, &used[first], sizeof of_row);
      for (of_row = of_row << 8 * beyond >> 8 * beyond; of_row; of_row &= of_row - 1)
        texels.push_back(static_cast<std::uint32_t>(first + std::countr_zero(of_row) / 8));
    }
  }
  return texels;
}

// One face's texels, which come tile after tile, become runs: whole tiles are never torn apart,
// small pieces of neighbouring tiles share a run.
void cut_face(const TexelOrder& order, int width, std::uint32_t face, std::uint32_t begin,
              std::uint32_t end, std::vector<TexelRun>& runs) {
  const double rows_a_texel = 1.0 / width;  // a division by a whole number takes a dozen cycles
  TexelRun run{face, begin, 0};
  PixelBox run_box;
  for (std::uint32_t i = begin; i < end;) {
    PixelBox piece_box;
    std::uint32_t next = i;
    for (; next < end; ++next) {
      const auto texel = static_cast<int>(order.texels[next]);
      const int y = static_cast<int>((texel + 0.5) * rows_a_texel), x = texel - y * width;
      if (next == i) piece_box = {x, y, x + 1, y + 1};
      if (((x ^ piece_box.x0) | (y ^ piece_box.y0)) >= kTile) break;  // in another tile
      piece_box = {std::min(piece_box.x0, x), piece_box.y0, std::max(piece_box.x1, x + 1), y + 1};
    }
    const PixelBox together = united(run_box, piece_box);
    const bool compact = together.width() <= kMostSpan && together.height() <= kMostSpan;
    if (run.count > 0 && (run.count + (next - i) > kChunk || !compact)) {
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
  const std::vector<std::uint32_t> along = along_curve(maps);
  std::vector<std::uint32_t> start = {0};  // by face, where its texels begin
  for (const std::uint32_t texel : along) {
    const std::size_t after = std::size_t{maps.face[texel]} + 1;
    if (after >= start.size()) start.resize(after + 1, 0);
    ++start[after];
  }
  std::partial_sum(start.begin(), start.end(), start.begin());
  TexelOrder order;
  order.texels.resize(along.size());
  std::vector<std::uint32_t> next = start;
  for (const std::uint32_t texel : along) order.texels[next[maps.face[texel]]++] = texel;
  for (std::uint32_t f = 0; f + 1 < start.size(); ++f)
    cut_face(order, maps.width, f, start[f], start[f + 1], order.runs);
  return order;
}

PatchTable::PatchTable(std::span<const Patch> patches) {
  faces_.reserve(patches.size());
  for (auto& numbers : numbers_) numbers.reserve(patches.size() + kLanes);
  for (const Patch& p : patches) {
    faces_.push_back(p.face);
    auto next = numbers_.begin();
    for (const auto* triple : {&p.center, &p.extent, &p.along_u, &p.along_v})
      for (const float number : *triple) (next++)->push_back(number);
    (next++)->push_back(p.cone.sine);
    next->push_back(p.cone.cosine);
  }
  for (auto& numbers : numbers_) numbers.resize(patches.size() + kLanes);
}

// (Not std::call_once: where what it calls throws, it never returns under ThreadSanitizer, nor
// with some other C libraries.)
struct SampleStore::Slot {
  std::mutex making;
  bool made = false;
  SampleSet set;
};

SampleStore::SampleStore(std::size_t cameras, Make make)
    : count_(cameras), slots_(std::make_unique<Slot[]>(cameras)), make_(std::move(make)) {}
SampleStore::~SampleStore() = default;

const SampleSet& SampleStore::made(std::size_t camera) {
  Slot& slot = slots_[camera];
  const std::lock_guard lock(slot.making);
  // A thread that waits inside must not pick up another camera, which could wait for this one.
  if (!slot.made) isolated([&] { slot.set = make_(camera); });
  slot.made = true;
  return slot.set;
}

void SampleStore::require(std::span<const std::size_t> cameras) {
  parallel_for(std::size_t{0}, cameras.size(), [&](std::size_t i) { made(cameras[i]); });
}

void SampleStore::require_all() {
  parallel_for(std::size_t{0}, count_, [&](std::size_t camera) { made(camera); });
}

void SampleStore::make_ahead() {
  ahead_.start([this](const std::atomic<bool>& stop) {
    try {
      for (std::size_t c = 0; c < count_ && !stop; ++c) made(c);
    } catch (const std::exception&) {
      // The view that needs this camera says so.
    }
  });
}

bool SampleStore::make_next() {
  if (next_ == count_) return false;
  made(next_);
  return ++next_ < count_;
}

void check_maps_fit(const CameraMaps& m, std::size_t camera, const Intrinsics& k,
                    std::size_t faces) {
  const std::size_t texels = std::size_t(k.width) * k.height;
  if (m.width != k.width || m.height != k.height || m.depth_mm.size() != texels ||
      m.color.size() != texels || m.height_mm.size() != texels || m.face.size() != texels ||
      m.confidence.size() != texels) {
    throw BadDataError("bundle: the maps of camera " + std::to_string(camera) +
                       " do not fit its size");
  }
  std::uint32_t most = 0;  // counted from 1: none is 0
  for (const std::uint32_t face : m.face) most = std::max(most, face + 1);
  if (most > faces) {
    throw BadDataError("bundle: camera " + std::to_string(camera) + " names face " +
                       std::to_string(most - 1) + ", the bundle has " + std::to_string(faces));
  }
}

void check_positions(const std::vector<Eigen::Vector3d>& positions, const TriangleMesh& proxy) {
  if (positions.size() != proxy.vertices.size()) {
    throw BadDataError("draw: " + std::to_string(positions.size()) + " positions for a proxy of " +
                       std::to_string(proxy.vertices.size()) + " vertices");
  }
  for (const Eigen::Vector3d& p : positions) {
    if (!p.allFinite()) throw BadDataError("draw: a proxy vertex is not finite");
  }
}

void check_fit(const Bundle& bundle) {
  const std::size_t cameras = bundle.cameras.cameras.size(), faces = shell_face_count(bundle);
  if (bundle.maps.size() != cameras || bundle.cameras.manifold.directions.size() != cameras) {
    throw BadDataError("bundle: cameras, maps and viewing manifold differ in number");
  }
  const BaseLayer& b = bundle.base;
  const std::size_t nodes = std::size_t(b.face_count) * b.nodes_per_face();
  if (b.face_count != 0 && (b.face_count != faces || b.steps < 1 || b.height_mm.size() != nodes ||
                            b.color.size() != nodes || b.seen_by.size() != nodes)) {
    throw BadDataError("bundle: the base layer does not fit the proxy or its skin");
  }
}

}  // namespace organbake
