// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/geometry/shell_map.h"
#include "samples/patch.h"

namespace organbake {

// Colour of one sample and the Taylor terms of its brightness along the map's columns (u) and rows
// (v), so that a pixel that looks beside the sample still gets the light of the very point it sees.
// Everything is in square-root light (255·√linear): as fine as sRGB in 8 bits, and squaring makes
// it linear. Eight ninths of what changes from texel to texel is brightness, the mean of the
// channels: terms of each channel would double what a frame reads, for 0.03 dB.
struct TexelDetail {
  std::uint8_t red = 0, green = 0, blue = 0;
  std::uint8_t confidence = 0;           // 255 = 1
  std::int8_t along_u = 0, along_v = 0;  // first differences per texel
  std::int8_t curve_u = 0, curve_v = 0;  // half of the second differences
};
// As one little-endian number, the form in which the inner loop gathers it.
using PackedDetail = std::uint64_t;
static_assert(sizeof(TexelDetail) == sizeof(PackedDetail));

// What a texel's pixels show where it is seen from so near that each covers several of them: at
// each corner of the texel the mean of the texels that meet there on the same surface, bilinear
// between them, and the texel's own colour in its middle. So colours run on over its borders. In
// square-root light, too. Word k: red, green and blue of corner k (u₀v₀, u₁v₀, u₀v₁, u₁v₁), and in
// the highest byte the texel's own red, green, blue and confidence.
using SmoothDetail = std::array<std::uint32_t, 4>;

// Where samples lie within their patch: center + extent × coordinate / kFullCoordinate, each
// coordinate of a sample in two bytes. A ten-thousandth of a texel is lost.
using PatchCoordinate = std::int16_t;
inline constexpr float kFullCoordinate = 32767;

// Samples come in chunks of at most kChunk, each of one patch; chunk c owns the slots from
// kChunk·c on, so that a slot number alone finds its chunk. Slots without a sample lie at the
// patch's middle: whole chunks are placed.
inline constexpr std::uint32_t kChunk = 64;

struct Chunk {
  Patch patch;
  std::uint32_t count = 0;  // samples in use, ≥ 1
};

// What one camera contributes: structure of arrays over slots, chunks sorted by face and then by
// map neighbourhood.
struct SampleSet {
  std::vector<PatchCoordinate> b1, b2, h;
  std::vector<PackedDetail> detail;
  std::vector<SmoothDetail> smooth;  // empty unless asked for
  std::vector<Chunk> chunks;
  PatchTable patches;  // the chunks', once more
  std::size_t sample_count = 0;
  double texel_mm = 0;  // mean size of a texel on the surface, facing the camera

  std::uint32_t face(std::size_t slot) const { return chunks[slot / kChunk].patch.face; }
  // (b1, b2, h) of one sample.
  std::array<float, 3> bound(std::size_t slot) const {
    const Patch& patch = chunks[slot / kChunk].patch;
    return {at(patch, 0, b1[slot]), at(patch, 1, b2[slot]), at(patch, 2, h[slot])};
  }

  // Bounds samples (b1, b2, h) by a patch, and keeps where they lie within it, from a slot on.
  void put(std::span<const Eigen::Array3f> bound, std::size_t first_slot, Patch& patch);
  // Makes `patches` those of the chunks.
  void copy_patches();

 private:
  static float at(const Patch& patch, int axis, PatchCoordinate at) {
    return patch.center[axis] + patch.extent[axis] / kFullCoordinate * static_cast<float>(at);
  }
};

// Slot numbers share a 64-bit key with depth and offsets.
inline constexpr std::uint32_t kMostSlots = 1u << 24;

// Binds every texel that has a face, and confidence. rest_in_camera holds the rest shell matrix of
// every proxy face in the camera's frame. Throws BadDataError when the map has more samples than
// kMostSlots. smooth: whether SampleSet::smooth is wanted.
SampleSet build_sample_set(const CameraMaps& maps, const PosedCamera& camera,
                           const std::vector<ShellMatrix>& rest_in_camera, bool smooth = false);

}  // namespace organbake
