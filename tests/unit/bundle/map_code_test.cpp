// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/map_code.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "organbake/core/random.h"
#include "support/error_message.h"

namespace organbake {
namespace {

constexpr int kSide = 40;
constexpr std::size_t kFaces = 30;
const Intrinsics kMapLens{kSide, kSide, 50, 50, 20, 20};

int byte_of(float share) { return static_cast<int>(255 * std::min(share, 1.0f) + 0.5f); }

// A wavy surface with a hole, an edge and noise of the colours.
CameraMaps wavy_maps() {
  RandomStream random(3);
  CameraMaps maps;
  maps.width = maps.height = kSide;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const bool there = std::hypot(x - 18, y - 22) < 17 && std::hypot(x - 12, y - 20) > 3;
      const double behind = x > 25 ? 30 : 0;
      maps.depth_mm.push_back(there ? float(100 + behind + 3 * std::sin(0.2 * x) + 0.1 * y)
                                    : std::numeric_limits<float>::infinity());
      maps.height_mm.push_back(there ? float(random.uniform(-2, 5)) : 0);
      maps.face.push_back(there ? std::uint32_t(x / 8 + 5 * (y / 8)) : kNoFace);
      maps.confidence.push_back(there ? float(random.uniform()) : 0);
      maps.color.emplace_back(Eigen::Vector3f::Zero());
      for (int k = 0; k < 3 && there; ++k) maps.color.back()[k] = float(random.uniform(-0.1, 1.2));
    }
  }
  return maps;
}

class MapCode : public testing::Test {
 protected:
  CameraMaps maps = wavy_maps();
  std::vector<std::byte> code = coded_maps(maps, kMapLens);
  CameraMaps back() const { return decoded_maps(code, kMapLens, kFaces, "maps"); }
};

TEST_F(MapCode, GivesBackWhatThePlayerMakesOfTheMaps) {
  const CameraMaps again = back();
  int drawn = 0;
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    const bool there = maps.face[i] != kNoFace && byte_of(maps.confidence[i]) > 0;
    ASSERT_EQ(again.face[i], there ? maps.face[i] : kNoFace) << i;
    if (!there) {
      EXPECT_TRUE(std::isinf(again.depth_mm[i]));
      continue;
    }
    ++drawn;
    EXPECT_EQ(byte_of(again.confidence[i]), byte_of(maps.confidence[i]));
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(byte_of(std::sqrt(again.color[i][k])),
                byte_of(std::sqrt(std::max(0.0f, maps.color[i][k]))));
    }
    // Half a step: a texel here is 2.2 mm wide.
    EXPECT_NEAR(again.depth_mm[i], maps.depth_mm[i], 2.5 / 256);
    EXPECT_NEAR(again.height_mm[i], maps.height_mm[i], 2.5 / 256);
  }
  EXPECT_GT(drawn, 500);
}

TEST_F(MapCode, CodesWhatItGaveBackToTheSameBytes) {
  EXPECT_EQ(coded_maps(back(), kMapLens).size(), code.size());
  const CameraMaps once = back(),
                   twice = decoded_maps(coded_maps(once, kMapLens), kMapLens, kFaces, "maps");
  EXPECT_EQ(once.face, twice.face);
  EXPECT_EQ(once.color, twice.color);
  EXPECT_EQ(once.confidence, twice.confidence);
}

TEST_F(MapCode, KeepsARangeOfMetresWithin65535Steps) {
  maps.depth_mm[20 * kSide + 20] = 5000;
  code = coded_maps(maps, kMapLens);
  EXPECT_NEAR(back().depth_mm[20 * kSide + 20], 5000, 4900.0 / 65533);
}

TEST_F(MapCode, TakesMapsOfNothing) {
  std::fill(maps.face.begin(), maps.face.end(), kNoFace);
  code = coded_maps(maps, kMapLens);
  const CameraMaps again = back();
  EXPECT_EQ(std::count(again.face.begin(), again.face.end(), kNoFace), kSide * kSide);
}

TEST_F(MapCode, RefusesAnotherSizeAndFacesThatAreNotThere) {
  Intrinsics other = kMapLens;
  other.width = kSide + 1;
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { decoded_maps(code, other, kFaces, "maps"); }),
              testing::HasSubstr("maps: is 40 × 40, its camera 41 × 40"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { decoded_maps(code, kMapLens, 5, "maps"); }),
              testing::HasSubstr("names a face"));
}

TEST_F(MapCode, RefusesEveryLengthButItsOwn) {
  for (std::size_t length = 0; length < code.size(); length += 7) {
    const auto shorter = std::span(code).first(length);
    EXPECT_THROW(decoded_maps(shorter, kMapLens, kFaces, "maps"), BadDataError) << length;
  }
  code.push_back(std::byte{0});
  EXPECT_THROW(back(), BadDataError);
}

TEST_F(MapCode, RefusesOrReadsWhateverStandsThere) {
  RandomStream random(5);
  int refused = 0;
  for (int m = 0; m < 2000; ++m) {
    std::vector<std::byte> changed = code;
    for (std::uint64_t i = 0; i <= random.below(8); ++i)
      changed[random.below(m % 2 ? changed.size() : 1700)] ^= std::byte(1u << random.below(8));
    try {
      const CameraMaps read = decoded_maps(changed, kMapLens, kFaces, "maps");
      for (std::size_t i = 0; i < read.face.size(); ++i) {
        if (read.face[i] == kNoFace) continue;
        ASSERT_LT(read.face[i], kFaces);
        ASSERT_TRUE(read.depth_mm[i] > 0 && std::isfinite(read.depth_mm[i]));
      }
    } catch (const BadDataError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace organbake
