// SPDX-License-Identifier: Apache-2.0
#include "samples/face_split.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace organbake {
namespace {

constexpr double kWidestMove = 0.5;  // of a part

// From places in a face to places in a part of it.
struct IntoPart {
  std::uint32_t face;
  Eigen::Vector2d origin;
  Eigen::Matrix2d turn;
  std::array<bool, 3> lip;

  explicit IntoPart(const CutOrgan::FacePart& part)
      : face(part.face), origin(part.at[0]), lip(part.lip) {
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
};

// The weights of a part's corners at a place, or how they change along a way.
Eigen::Vector3d weights_at(const Eigen::Vector2d& b) { return {1 - b.sum(), b.x(), b.y()}; }
Eigen::Vector3d weights_along(const Eigen::Vector2d& b) { return {-b.sum(), b.x(), b.y()}; }

// The film of blood along lips, on texels of a size: on each as much of it as lies on the rim.
class BloodFilm {
 public:
  explicit BloodFilm(double texel_mm) : texels_(CutOrgan::kWetRim_mm / std::max(texel_mm, 1e-3)) {}

  // How much of a texel is wet whose middle lies so many half texels from a lip: all on the inner
  // half of the rim, less and less on the outer.
  double share_at(double half_texels) const {
    return std::clamp(2 - half_texels / (texels_ + 0.5), 0.0, std::min(1.0, texels_));
  }
  void cover(double share) {
    for (int c = 0; c < 3; ++c)  // of square-root light
      kept_[c] = std::sqrt(1 - share * (1 - CutOrgan::kBloodFilm[c]));
  }

  PackedDetail over(PackedDetail packed) const {
    auto texel = __builtin_bit_cast(TexelDetail, packed);
    texel.red = dimmed(texel.red, 0);
    texel.green = dimmed(texel.green, 1);
    texel.blue = dimmed(texel.blue, 2);
    const double mean = (kept_[0] + kept_[1] + kept_[2]) / 3;
    for (std::int8_t* term : {&texel.along_u, &texel.along_v, &texel.curve_u, &texel.curve_v})
      *term = static_cast<std::int8_t>(std::lround(mean * *term));
    return __builtin_bit_cast(PackedDetail, texel);
  }
  SmoothDetail over(SmoothDetail texel) const {
    for (int k = 0; k < 4; ++k) {
      std::uint32_t word = 0;
      for (int c = 0; c < 3; ++c)
        word |= std::uint32_t{dimmed(texel[k] >> (8 * c) & 255u, c)} << (8 * c);
      const std::uint32_t middle = texel[k] >> 24;
      texel[k] = word | (k < 3 ? dimmed(middle, k) : middle) << 24;
    }
    return texel;
  }

 private:
  std::uint8_t dimmed(std::uint32_t value, int channel) const {
    return static_cast<std::uint8_t>(std::lround(kept_[channel] * value));
  }

  double texels_;  // across the rim
  std::array<double, 3> kept_{1, 1, 1};
};

// A sample's place in a part, moved back from its lips by half a texel, so that no texel hangs over
// them; where a part is too narrow for that it stays. along_u, along_v: of a texel, in the part.
Eigen::Vector2d within_lips(const IntoPart& part, const Eigen::Vector2d& at,
                            const Eigen::Vector2d& along_u, const Eigen::Vector2d& along_v) {
  Eigen::Vector3d weights = weights_at(at);
  const Eigen::Vector3d half =
      0.5 * (weights_along(along_u).cwiseAbs() + weights_along(along_v).cwiseAbs());
  for (int k = 0; k < 3; ++k) {
    if (!part.lip[k] || weights[k] >= half[k] || half[k] > kWidestMove) continue;
    // Toward the corner across from the lip.
    weights *= (1 - half[k]) / (1 - weights[k]);
    weights[k] = half[k];
  }
  return {weights[1], weights[2]};
}

// Of a texel, how the weights of a part's corners change over half of it.
Eigen::Vector3d half_texel(const IntoPart& part, const Eigen::Vector2d& along_u,
                           const Eigen::Vector2d& along_v) {
  return 0.5 * (weights_along(part.turn * along_u).cwiseAbs() +
                weights_along(part.turn * along_v).cwiseAbs());
}

// How far the nearest lip of a part is from a place in the face, on either side, in half texels.
double from_lip(const IntoPart& part, const Eigen::Vector2d& at,
                const Eigen::Vector3d& half_texel) {
  const Eigen::Vector3d weights = weights_at(part(at));
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3, last = (k + 2) % 3;
    if (part.lip[k] && half_texel[k] > 0 && weights[next] > -half_texel[next] &&
        weights[last] > -half_texel[last])
      nearest = std::min(nearest, std::abs(weights[k]) / half_texel[k]);
  }
  return nearest;
}

// Samples of a chunk that lie in one part.
struct Group {
  std::vector<std::uint32_t> from_slots;
  std::vector<Eigen::Array3f> bound;
  std::vector<double> wet;  // share of the texel
};

class ChunkSplitter {
 public:
  ChunkSplitter(const SampleSet& from, SampleSet& to)
      : from_(from), to_(to), film_(from.texel_mm) {}

  void split(std::uint32_t chunk, const std::vector<IntoPart>& parts) {
    std::vector<Group> groups(parts.size());
    const Patch& patch = from_.chunks[chunk].patch;
    const Eigen::Vector2d along_u(patch.along_u[0], patch.along_u[1]),
        along_v(patch.along_v[0], patch.along_v[1]);
    for (std::uint32_t i = 0; i < from_.chunks[chunk].count; ++i) {
      const std::uint32_t slot = chunk * kChunk + i;
      const std::array<float, 3> bound = from_.bound(slot);
      const Eigen::Vector2d at(bound[0], bound[1]);
      std::size_t best = 0;
      double deepest = -std::numeric_limits<double>::infinity();
      for (std::size_t p = 0; p < parts.size(); ++p) {
        const double depth = parts[p].depth(at);
        if (depth > deepest) deepest = depth, best = p;
      }
      const Eigen::Vector2d in_part = within_lips(
          parts[best], parts[best](at), parts[best].turn * along_u, parts[best].turn * along_v);
      double nearest = std::numeric_limits<double>::infinity();
      for (const IntoPart& part : parts)
        nearest = std::min(nearest, from_lip(part, at, half_texel(part, along_u, along_v)));
      groups[best].wet.push_back(film_.share_at(nearest));
      groups[best].from_slots.push_back(slot);
      groups[best].bound.emplace_back(static_cast<float>(in_part.x()),
                                      static_cast<float>(in_part.y()), bound[2]);
    }
    bool own = true;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      if (groups[p].bound.empty()) continue;
      const std::uint32_t at = std::exchange(own, false) ? chunk : add_chunk();
      put(at, from_.chunks[chunk].patch, parts[p], groups[p]);
    }
  }

 private:
  std::uint32_t add_chunk() {
    to_.chunks.emplace_back();
    const std::size_t slots = to_.chunks.size() * kChunk;
    to_.b1.resize(slots), to_.b2.resize(slots), to_.h.resize(slots), to_.detail.resize(slots);
    if (!to_.smooth.empty()) to_.smooth.resize(slots);
    return static_cast<std::uint32_t>(to_.chunks.size() - 1);
  }

  void put(std::uint32_t chunk, const Patch& was, const IntoPart& part, const Group& group) {
    Chunk& made = to_.chunks[chunk];
    made.count = static_cast<std::uint32_t>(group.bound.size());
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
    for (std::vector<PatchCoordinate>* places : {&to_.b1, &to_.b2, &to_.h})
      std::fill_n(places->begin() + static_cast<std::ptrdiff_t>(first), kChunk, PatchCoordinate{0});
    to_.put(group.bound, first, patch);
    for (std::size_t i = 0; i < group.from_slots.size(); ++i) {
      const auto put = [&](const auto& from, auto& to) {
        const auto& texel = from[group.from_slots[i]];
        to[first + i] = group.wet[i] > 0 ? film_.over(texel) : texel;
      };
      if (group.wet[i] > 0) film_.cover(group.wet[i]);
      put(from_.detail, to_.detail);
      if (!to_.smooth.empty()) put(from_.smooth, to_.smooth);
    }
  }

  const SampleSet& from_;
  SampleSet& to_;
  BloodFilm film_;
};

}  // namespace

SampleSet split_samples(const SampleSet& set, const CutOrgan::FaceParts& parts) {
  SampleSet split = set;
  ChunkSplitter splitter(set, split);
  for (std::uint32_t c = 0; c < set.chunks.size(); ++c) {
    const auto found = parts.find(set.chunks[c].patch.face);
    if (found == parts.end()) continue;
    const std::vector<IntoPart> into(found->second.begin(), found->second.end());
    splitter.split(c, into);
  }
  split.copy_patches();
  return split;
}

}  // namespace organbake
