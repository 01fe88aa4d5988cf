// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/voxel_decoding.h"

#include <gmock/gmock.h>

#include <cstring>
#include <limits>

#include "core/temporary_folder.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <typename Stored>
Volume converted(ScalarType type, const std::vector<Stored>& values, double slope = 1,
                 double intercept = 0) {
  Volume volume;
  volume.size = {static_cast<int>(values.size()), 1, 1};
  volume.voxels.resize(values.size());
  ConversionLoss loss;
  convert_voxels(reinterpret_cast<const std::byte*>(values.data()), values.size(),
                 {type, false, slope, intercept}, volume, 0, loss);
  settle_losses(loss, volume, "scan");
  return volume;
}

TEST(VoxelDecoding, WholeNumbersPassWithoutAWarning) {
  const Volume volume = converted<std::uint16_t>(ScalarType::uint16, {0, 1024, 33791}, 1, -1024);
  EXPECT_THAT(volume.voxels, ElementsAre(-1024, 0, 32767));
  EXPECT_THAT(volume.warnings, IsEmpty());
  EXPECT_THAT(converted<float>(ScalarType::float32, {3.0000002f, -7}).warnings, IsEmpty());
}

TEST(VoxelDecoding, RoundingAndClampingAreTold) {
  const Volume volume = converted<double>(ScalarType::float64, {1.4, 1.6, 40000, -kInfinity});
  EXPECT_THAT(volume.voxels, ElementsAre(1, 2, 32767, -32768));
  EXPECT_THAT(volume.warnings, Contains("2 of 4 voxels were rounded to whole units"));
  EXPECT_THAT(volume.warnings, Contains("2 of 4 voxels were clamped to −32768…32767"));
}

TEST(VoxelDecoding, NanBecomesTheLowestValue) {
  const Volume volume = converted<double>(ScalarType::float64, {kNan, 5, kNan, kNan, -3, kNan});
  EXPECT_THAT(volume.voxels, ElementsAre(-3, 5, -3, -3, -3, -3));
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("4 of 6 voxels are NaN")));
  EXPECT_THAT(message_of(ExitCode::bad_data,
                         [] {
                           converted<double>(ScalarType::float64, {kNan, kNan});
                         }),
              HasSubstr("every voxel is NaN"));
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
