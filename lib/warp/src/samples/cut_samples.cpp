// SPDX-License-Identifier: Apache-2.0
// Samples after blades have cut: each goes with the part of its face that holds it.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "samples/samples.h"

namespace organbake {
namespace {

// From places in a face to places in a part of it.
struct IntoPart : CutOrgan::FacePart {
  Eigen::Vector2d origin;
  Eigen::Matrix2d turn;

  explicit IntoPart(const CutOrgan::FacePart& part) : FacePart(part), origin(part.at[0]) {
    Eigen::Matrix2d sides;
    sides << part.at[1] - part.at[0], part.at[2] - part.at[0];
    turn = sides.inverse();
  }
  Eigen::Vector2d operator()(const Eigen::Vector2d& at) const { return turn * (at - origin); }
  // The least of the three weights: not below 0 inside.
  double depth(const Eigen::Vector2d& at) const {
    const Eigen::Vector2d b = (*this)(at);
    return std::min({b.x(), b.y(), 1 - b.sum()});
  }
  // How much nearer to a lip a texel's edge may lie than its middle; along_u, along_v: of a texel.
  double half_texel_mm(const Eigen::Vector2d& along_u, const Eigen::Vector2d& along_v) const {
    const Eigen::Vector2d nearer(from_lip_mm[1] - from_lip_mm[0], from_lip_mm[2] - from_lip_mm[0]);
    return 0.5 * (std::abs(nearer.dot(turn * along_u)) + std::abs(nearer.dot(turn * along_v)));
  }
};

// Samples of a chunk that lie in one part.
struct Group {
  SampleSet::Bound bound;
  std::vector<TexelColors> colors;
};

void put_group(SampleSet& set, std::uint32_t chunk, const Patch& was, const IntoPart& part,
               Group& group) {
  Chunk& made = set.chunks[chunk];
  made.count = static_cast<std::uint32_t>(group.colors.size());
  Patch& patch = made.patch;
  patch = was;
  patch.face = part.face;
  const auto turn = [&](const float(&along)[3], float(&out)[3]) {
    const Eigen::Vector2d b = part.turn * Eigen::Vector2d(along[0], along[1]);
    out[0] = static_cast<float>(b.x()), out[1] = static_cast<float>(b.y()), out[2] = along[2];
  };
  turn(was.along_u, patch.along_u);
  turn(was.along_v, patch.along_v);
  const std::size_t first = std::size_t{chunk} * kChunk;
  for (std::vector<PatchCoordinate>* places : {&set.b1, &set.b2, &set.h})
    std::fill_n(places->begin() + static_cast<std::ptrdiff_t>(first), kChunk, PatchCoordinate{0});
  set.put(group.bound, made.count, first, patch);
  std::copy(group.colors.begin(), group.colors.end(),
            set.colors.begin() + static_cast<std::ptrdiff_t>(first));
}

// The first part that gets samples takes the chunk's own slots, each other one a new chunk.
void split_chunk(SampleSet& set, std::uint32_t chunk, const std::vector<IntoPart>& parts) {
  std::vector<Group> groups(parts.size());
  const Patch patch = set.chunks[chunk].patch;
  const Eigen::Vector2d along_u(patch.along_u[0], patch.along_u[1]),
      along_v(patch.along_v[0], patch.along_v[1]);
  for (std::uint32_t i = 0; i < set.chunks[chunk].count; ++i) {
    const std::uint32_t slot = chunk * kChunk + i;
    const std::array<float, 3> bound = set.bound(slot);
    const Eigen::Vector2d at(bound[0], bound[1]);
    std::size_t best = 0;
    double deepest = -std::numeric_limits<double>::infinity();
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const double depth = parts[p].depth(at);
      if (depth > deepest) deepest = depth, best = p;
    }
    const IntoPart& part = parts[best];
    const Eigen::Vector2d in_part = part(at);
    // A texel that would hang over a lip is left out: the base layer lies there.
    if (part.away_mm(in_part) <= part.half_texel_mm(along_u, along_v)) continue;
    Group& group = groups[best];
    const std::size_t next = group.colors.size();
    group.bound[0][next] = static_cast<float>(in_part.x());
    group.bound[1][next] = static_cast<float>(in_part.y());
    group.bound[2][next] = part.limited(bound[2], in_part);
    group.colors.push_back(set.colors[slot]);
  }
  set.chunks[chunk].count = 0;
  bool own = true;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (groups[p].colors.empty()) continue;
    if (!std::exchange(own, false)) {
      set.chunks.emplace_back();
      const std::size_t slots = set.chunks.size() * kChunk;
      set.b1.resize(slots), set.b2.resize(slots), set.h.resize(slots), set.colors.resize(slots);
      chunk = static_cast<std::uint32_t>(set.chunks.size() - 1);
    }
    put_group(set, chunk, patch, parts[p], groups[p]);
  }
}

}  // namespace

void split_samples(const CutOrgan::FaceParts& parts, SampleSet& set) {
  const std::size_t uncut = set.chunks.size();
  for (std::uint32_t c = 0; c < uncut; ++c) {
    const auto found = parts.find(set.chunks[c].patch.face);
    if (found == parts.end()) continue;
    const std::vector<IntoPart> into(found->second.begin(), found->second.end());
    split_chunk(set, c, into);
  }
  set.copy_patches();
}

}  // namespace organbake
