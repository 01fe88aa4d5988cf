// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/voxel_decoding.h"

#include <gmock/gmock.h>

#include <cstring>
#include <limits>

#include "organbake/core/temporary_folder.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsNan;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <typename Stored>
Volume converted(ScalarType type, const std::vector<Stored>& values, double slope = 1,
                 double intercept = 0) {
  Volume volume;
  volume.size = {static_cast<int>(values.size()), 1, 1};
  volume.voxels.resize(values.size());
  convert_voxels(reinterpret_cast<const std::byte*>(values.data()), values.size(),
                 {type, false, slope, intercept}, volume, 0);
  settle_values(volume, "scan");
  return volume;
}

TEST(VoxelDecoding, WholeNumbersOf16BitsStayThemselves) {
  const Volume volume = converted<std::uint16_t>(ScalarType::uint16, {0, 1024, 33791}, 1, -1024);
  EXPECT_THAT(volume.voxels, ElementsAre(-1024, 0, 32767));
  EXPECT_THAT(volume.warnings, IsEmpty());
  EXPECT_FALSE(volume.is_real());
  // Whatever their type, and when they were scaled, as far as float32 tells.
  EXPECT_THAT(converted<double>(ScalarType::float64, {-32768, 7}).voxels, ElementsAre(-32768, 7));
  EXPECT_THAT(converted<std::uint8_t>(ScalarType::uint8, {10, 200}, 0.1f, 0).voxels,
              ElementsAre(1, 20));
}

TEST(VoxelDecoding, OtherValuesAreKeptAsTheyAre) {
  const auto kept = [](const Volume& volume) {
    EXPECT_TRUE(volume.voxels.empty());
    EXPECT_THAT(volume.warnings, IsEmpty());
    return volume.reals;
  };
  EXPECT_THAT(kept(converted<double>(ScalarType::float64, {1, 0.25, -3})),
              ElementsAre(1, 0.25f, -3));
  EXPECT_THAT(kept(converted<float>(ScalarType::float32, {0, 3e-4f})), ElementsAre(0, 3e-4f))
      << "small numbers are no noughts";
  EXPECT_THAT(kept(converted<std::uint16_t>(ScalarType::uint16, {7, 40000})),
              ElementsAre(7, 40000));
  EXPECT_THAT(kept(converted<std::int32_t>(ScalarType::int32, {-100000, 3})),
              ElementsAre(-100000, 3));
  EXPECT_THAT(kept(converted<std::uint8_t>(ScalarType::uint8, {3, 4}, 0.5, 1)),
              ElementsAre(2.5f, 3));
}

TEST(VoxelDecoding, AVolumeBecomesRealWithItsFirstValueThatIsNotWhole) {
  Volume volume;
  volume.size = {4, 1, 1};
  volume.voxels.resize(4);
  const std::vector<float> first = {5, -6}, later = {0.5f, 7};
  const VoxelEncoding encoding{ScalarType::float32, false, 1, 0};
  convert_voxels(reinterpret_cast<const std::byte*>(first.data()), 2, encoding, volume, 0);
  EXPECT_FALSE(volume.is_real());
  convert_voxels(reinterpret_cast<const std::byte*>(later.data()), 2, encoding, volume, 2);
  EXPECT_THAT(volume.reals, ElementsAre(5, -6, 0.5f, 7));
}

TEST(VoxelDecoding, NanStaysNanAndIsTold) {
  const Volume volume = converted<double>(ScalarType::float64, {kNan, 5, kNan, kNan, -3, kNan});
  EXPECT_THAT(volume.reals, ElementsAre(IsNan(), 5, IsNan(), IsNan(), -3, IsNan()));
  EXPECT_THAT(volume.warnings, Contains("4 of 6 voxels are NaN; they count as outside"));
  const ValueRange range = value_range(volume);
  EXPECT_EQ(range.min, -3);
  EXPECT_EQ(range.max, 5);
  EXPECT_TRUE(range.has_nan);
  EXPECT_THAT(message_of(ExitCode::bad_data,
                         [] {
                           converted<double>(ScalarType::float64, {kNan, kNan});
                         }),
              HasSubstr("every voxel is NaN"));
}

TEST(VoxelDecoding, WhatIsBeyondReckoningIsTold) {
  const Volume volume = converted<double>(ScalarType::float64, {1e300, 0.5, -kInfinity});
  EXPECT_THAT(volume.reals, ElementsAre(1e30f, 0.5f, -1e30f));
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("2 of 3 voxels are infinite or beyond ±1e30")));
}

TEST(MakeLabels, RoundsToWholeNumbersAndTakesNanAsBackground) {
  Volume mask = converted<double>(ScalarType::float64, {kNan, 1, 0.7, 0.2});
  make_labels(mask);
  EXPECT_THAT(mask.voxels, ElementsAre(0, 1, 1, 0));
  EXPECT_THAT(mask.warnings, Contains(HasSubstr("2 of 4 voxels are no whole numbers")));
  Volume wide = converted<std::uint16_t>(ScalarType::uint16, {0, 40000});
  make_labels(wide);
  EXPECT_THAT(wide.reals, ElementsAre(0, 40000));
  EXPECT_EQ(count_labels(wide).at(0).label, 40000);
}

TEST(VoxelDecoding, EveryTypeIsReadInBothByteOrders) {
  const TemporaryFolder folder;
  const auto round_trip = [&](ScalarType type, auto value) {
    std::string little(sizeof(value), '\0');
    std::memcpy(little.data(), &value, sizeof(value));
    for (const bool big_endian : {false, true}) {
      write_bytes(folder.path() / "raw",
                  big_endian ? std::string(little.rbegin(), little.rend()) : little);
      ByteStream stream(folder.path() / "raw");
      Volume volume;
      volume.size = {1, 1, 1};
      decode_voxels(stream, {type, big_endian, 1, 0}, volume);
      EXPECT_EQ(volume.voxels[0], static_cast<std::int16_t>(value)) << static_cast<int>(type);
    }
  };
  round_trip(ScalarType::int8, std::int8_t{-100});
  round_trip(ScalarType::uint8, std::uint8_t{200});
  round_trip(ScalarType::int16, std::int16_t{-1024});
  round_trip(ScalarType::uint16, std::uint16_t{3071});
  round_trip(ScalarType::int32, std::int32_t{-1024});
  round_trip(ScalarType::uint32, std::uint32_t{3071});
  round_trip(ScalarType::int64, std::int64_t{-1024});
  round_trip(ScalarType::uint64, std::uint64_t{3071});
  round_trip(ScalarType::float32, -1024.0f);
  round_trip(ScalarType::float64, 3071.0);
}

TEST(VoxelDecoding, TextMustHoldExactlyTheVoxels) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    write_bytes(folder.path() / "text", text);
    ByteStream stream(folder.path() / "text");
    Volume volume;
    volume.size = {3, 1, 1};
    decode_text_voxels(stream, {}, volume);
    return volume;
  };
  EXPECT_THAT(read(" 1\n-2.0 3e2 \n").voxels, ElementsAre(1, -2, 300));
  for (const char* text : {"1 2", "1 2 3 4", "1 x 3", "", "1 2 3x"}) {
    message_of(ExitCode::bad_data, [&] { read(text); });
  }
}

}  // namespace
}  // namespace organbake
