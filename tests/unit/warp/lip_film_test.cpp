// SPDX-License-Identifier: GPL-3.0-or-later
// The film of blood along a lip from (10, 0) to (10, 10) mm on a flat square of two faces.
#include "samples/lip_film.h"

#include <gtest/gtest.h>

#include <cmath>

namespace organbake {
namespace {

constexpr int kAcross = 8;  // texels of a chunk
constexpr double kTexel_mm = 0.4;
constexpr std::uint8_t kGrey = 200;

const TriangleMesh kSquare = {
    {{0, 0, 0}, {20, 0, 0}, {0, 20, 0}, {20, 20, 0}}, {{0, 1, 2}, {1, 3, 2}}, {}};
const CutOrgan::FaceParts kParts = {
    {0, {{0, {{{0.5, 0}, {0.5, 0.5}, {0, 0}}}, {false, false, true}}}}};

// One chunk of grey texels on a face, whose first texel's middle lies at (x, y) mm.
SampleSet grey_texels(std::uint32_t face, double x_mm, double y_mm) {
  const auto [a, b, c] = kSquare.faces[face];
  Eigen::Matrix2d sides;
  sides << (kSquare.vertices[b] - kSquare.vertices[a]).head<2>(),
      (kSquare.vertices[c] - kSquare.vertices[a]).head<2>();
  const Eigen::Matrix2d into_face = sides.inverse();
  SampleSet set;
  set.texel_mm = kTexel_mm;
  set.chunks.resize(1);
  set.chunks[0].count = kChunk;
  set.b1.resize(kChunk), set.b2.resize(kChunk), set.h.resize(kChunk);
  Patch& patch = set.chunks[0].patch;
  patch.face = face;
  for (int k = 0; k < 2; ++k) {
    patch.along_u[k] = static_cast<float>(kTexel_mm * into_face(k, 0));
    patch.along_v[k] = static_cast<float>(kTexel_mm * into_face(k, 1));
  }
  std::vector<Eigen::Array3f> bound;
  for (int i = 0; i < kAcross * kAcross; ++i) {
    const Eigen::Vector2d place_mm(x_mm + kTexel_mm * (i % kAcross),
                                   y_mm + kTexel_mm * (i / kAcross));
    const Eigen::Vector2d at = into_face * (place_mm - kSquare.vertices[a].head<2>());
    bound.emplace_back(float(at[0]), float(at[1]), 0.0f);
  }
  set.put(bound, 0, patch);
  const TexelDetail grey{kGrey, kGrey, kGrey, 255, 0, 0, 0, 0};
  set.detail.assign(kChunk, __builtin_bit_cast(PackedDetail, grey));
  set.smooth.assign(kChunk, {0xc8c8c8c8u, 0xc8c8c8c8u, 0xc8c8c8c8u, 0xffc8c8c8u});
  return set;
}

TexelDetail texel(const SampleSet& set, int i) {
  return __builtin_bit_cast(TexelDetail, set.detail[i]);
}

TEST(LipFilm, WetsTheRimAndNothingElse) {
  SampleSet set = grey_texels(0, 8, 2);
  const SampleSet dry = set;
  wet_samples(kSquare, WetRim(kSquare, kParts), set);
  for (int i = 0; i < kAcross * kAcross; ++i) {
    const double from_lip_mm = std::abs(8 + kTexel_mm * (i % kAcross) - 10);
    if (from_lip_mm > WetRim::reach_mm(kTexel_mm) + kTexel_mm) {
      EXPECT_EQ(set.detail[i], dry.detail[i]);
      EXPECT_EQ(set.smooth[i], dry.smooth[i]);
    }
    if (from_lip_mm < 0.45) {
      EXPECT_EQ(texel(set, i).red, std::lround(kGrey * std::sqrt(WetRim::kept(1)[0])));
      EXPECT_LT(texel(set, i).blue, texel(set, i).red);
    }
  }
}

// Texels that are dark as a whole would step by what `deepest` tells.
TEST(LipFilm, RunsOnFromTexelToTexel) {
  constexpr double kStep = 12;  // parabolas round the bends off in which the film begins and ends
  SampleSet set = grey_texels(0, 8, 2);
  wet_samples(kSquare, WetRim(kSquare, kParts), set);
  const auto brightness = [&](int i, double u) {
    const TexelDetail t = texel(set, i);
    return (t.red + t.green + t.blue) / 3.0 + u * t.along_u + u * u * t.curve_u;
  };
  double deepest = 0;
  for (int i = 0; i + 1 < kAcross * kAcross; ++i) {
    if (i % kAcross == kAcross - 1) continue;
    EXPECT_NEAR(brightness(i, 0.5), brightness(i + 1, -0.5), kStep);
    EXPECT_EQ(set.smooth[i][1] & 0xffffffu, set.smooth[i + 1][0] & 0xffffffu);
    EXPECT_EQ(set.smooth[i][3] & 0xffffffu, set.smooth[i + 1][2] & 0xffffffu);
    deepest = std::max(deepest, std::abs(brightness(i, 0) - brightness(i + 1, 0)));
  }
  EXPECT_GT(deepest, 5 * kStep);
}

// Around the lip's end, and on a face that is not cut itself.
TEST(LipFilm, RunsOnToTheFacesBesideACutOne) {
  SampleSet set = grey_texels(1, 10.2, 10.2);
  wet_samples(kSquare, WetRim(kSquare, kParts), set);
  EXPECT_EQ(texel(set, 0).red, std::lround(kGrey * std::sqrt(WetRim::kept(1)[0])));
  EXPECT_EQ(texel(set, kAcross * kAcross - 1).red, kGrey);
}

}  // namespace
}  // namespace organbake
