// SPDX-License-Identifier: GPL-3.0-or-later
// Grids, boxes of the world, figures, and voxels of any type.
#include "organbake/volume/volume.h"

#include "files/volume_files.h"
#include "grid/grids.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/volume/read_volume.h"
#include "support/files.h"
#include "support/testing.h"
#include "volume_fixtures.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

constexpr double kRoundOff_mm = 1e-9;

TEST(Volume, KnowsItsRangeAndLabels) {
  Volume volume = ramp_volume();
  volume.voxels.assign(60, 0);
  volume.voxels[3] = -32768;
  volume.voxels[7] = volume.voxels[8] = 32767;
  EXPECT_EQ(value_range(volume).min, -32768);
  EXPECT_EQ(value_range(volume).max, 32767);
  const auto labels = count_labels(volume);
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_EQ(labels[1].label, 32767);
  EXPECT_EQ(labels[1].voxels, 2u);
}

TEST(Volume, ChecksRefuseWhatIsNot) {
  const auto spoiled = [](auto spoil) {
    Volume volume = ramp_volume();
    spoil(volume);
    return message_of(ExitCode::bad_data, [&] { check_volume(volume, "scan"); });
  };
  EXPECT_THAT(spoiled([](Volume& v) { v.size[1] = 0; }), HasSubstr("scan: a volume of 5×0×3"));
  EXPECT_THAT(spoiled([](Volume& v) { v.voxels.pop_back(); }), HasSubstr("59 values"));
  EXPECT_THAT(spoiled([](Volume& v) { v.spacing_mm[2] = 0; }), HasSubstr("spacing along axis 2"));
  EXPECT_THAT(spoiled([](Volume& v) { v.spacing_mm[2] = -3; }), HasSubstr("must be in"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(spoiled([&](Volume& v) { v.spacing_mm[0] = nan; }), HasSubstr("spacing"));
  EXPECT_THAT(spoiled([](Volume& v) { v.spacing_mm[0] = 5e-324; }), HasSubstr("must be in"));
  EXPECT_THAT(spoiled([](Volume& v) { v.origin_mm[1] = 1e300; }), HasSubstr("within 1e9 mm"));
  EXPECT_THAT(spoiled([&](Volume& v) { v.origin_mm[0] = nan; }), HasSubstr("not finite"));
  EXPECT_THAT(spoiled([](Volume& v) { v.direction(0, 1) = 0.1; }), HasSubstr("perpendicular"));
}

TEST(Volume, GridsAreTheSameByPlaceNotByHeader) {
  const Volume volume = ramp_volume();
  Volume other = volume;
  EXPECT_TRUE(same_grid(volume, other));
  other.origin_mm.x() += 0.1;
  EXPECT_FALSE(same_grid(volume, other));
  other = volume;
  other.spacing_mm.z() *= 1.01;  // 0.06 mm at the far end
  EXPECT_FALSE(same_grid(volume, other));
}

const Eigen::Matrix3d kUprightBox = Eigen::Matrix3d::Identity();

TEST(Region, IsParsedFromTwoCorners) {
  const Region region = parse_region("10,-5,3, -2,7,9", "--roi");
  EXPECT_EQ(region.min_mm, Eigen::Vector3d(-2, -5, 3));
  EXPECT_EQ(region.max_mm, Eigen::Vector3d(10, 7, 9));
  for (const char* text : {"1,2,3", "a,b,c,d,e,f", "0,0,0,1,1,0", "1,2,3,4,5,6,7", ""}) {
    EXPECT_THAT(message_of(ExitCode::usage, [&] { parse_region(text, "--roi"); }),
                HasSubstr("--roi"))
        << text;
  }
}

TEST(Region, TakesOneVoxelMoreOnEverySide) {
  Volume grid;
  grid.size = {10, 10, 10};
  grid.spacing_mm = {1, 2, 3};
  const IndexBox box = voxels_of_region(grid, {{2.5, -50, 6}, {4.5, 4, 6.5}}, "grid");
  EXPECT_EQ(box.first, (std::array<int, 3>{1, 0, 1}));
  EXPECT_EQ(box.size, (std::array<int, 3>{6, 4, 4}));
  const Region outside = {{100, 0, 0}, {110, 5, 5}};
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { voxels_of_region(grid, outside, "grid"); }),
              HasSubstr("lies outside the volume"));
}

// A small box by the last voxel: fewer voxels on every axis, each in its own place.
Region corner_of(const Volume& volume) {
  const Eigen::Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  const Eigen::Vector3d corner = volume.world_from_index(last.array() + 0.2);
  return {corner.array() - 0.05, corner.array() + 0.05};
}

void expect_part_of(const Volume& whole, const Volume& part, double tolerance_hu) {
  EXPECT_LT(part.voxels.size(), whole.voxels.size());
  EXPECT_LT(largest_ramp_error(part), tolerance_hu);
}

TEST(Region, CropsFilesOfEveryKind) {
  const TemporaryFolder folder;
  const Volume ramp = ramp_volume(oblique_direction());
  const auto packed = folder.path() / "ramp.mha";
  write_metaimage(packed, ramp);
  const Volume whole = read_volume(packed);
  expect_part_of(whole, read_volume(packed, {.region = corner_of(whole)}), kRounding_hu);
  const auto nifti = folder.path() / "ramp.nii.gz";
  const NiftiBytes bytes(ramp);
  write_bytes(nifti, gzipped(bytes.bytes()));
  expect_part_of(whole, read_volume(nifti, {.region = corner_of(whole)}), kRounding_hu);
}

TEST(Region, AGridAloneIsThatOfTheWholeFile) {
  const TemporaryFolder folder;
  const Volume ramp = ramp_volume(oblique_direction());
  const auto packed = folder.path() / "ramp.mha", nifti = folder.path() / "ramp.nii.gz";
  write_metaimage(packed, ramp);
  write_bytes(nifti, gzipped(NiftiBytes(ramp).bytes()));
  for (const auto& file : {packed, nifti}) {
    const Volume grid = read_volume(file, {.grid_only = true});
    EXPECT_EQ(grid.voxel_count(), 0u) << file;
    EXPECT_TRUE(same_grid(grid, read_volume(file))) << file;
  }
}

// Bytes that this process asked its files for; 0 where the kernel does not tell.
double bytes_read() { return number_behind("rchar:", "/proc/self/io").value_or(0); }

TEST(Region, LittleMoreIsReadOfAFileThanItHolds) {
  if (bytes_read() == 0) GTEST_SKIP() << "the kernel does not tell what is read";
  Volume volume;
  volume.size = {64, 64, 200};
  volume.spacing_mm = {1, 1, 1};
  volume.voxels.assign(64 * 64 * 200, 7);
  const TemporaryFolder folder;
  const auto file = folder.path() / "raw.mha";
  std::string bytes =
      "NDims = 3\nDimSize = 64 64 200\nElementSpacing = 1 1 1\nOffset = 0 0 0\n"
      "ElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  bytes.append(reinterpret_cast<const char*>(volume.voxels.data()), 2 * volume.voxels.size());
  write_bytes(file, bytes);
  const double before = bytes_read();
  const Volume part = read_volume(file, {.region = Region{{0, 0, 100}, {63, 63, 117}}});
  EXPECT_EQ(part.size[2], 20);
  EXPECT_LT(bytes_read() - before, 0.1 * double(bytes.size()) + 20'000);  // and what opens a file
}

class DicomRegionTest : public DicomFolderTest {};

TEST_F(DicomRegionTest, ReadsOnlyTheSlicesItNeeds) {
  add_stack({0, 2, 4, 6, 8, 10, 12}, kUprightBox);
  DicomBytes torn = slice_at({5, -8, 32}, kUprightBox);  // the last one's pixels cannot be decoded
  torn.photometric = "RGB";
  add("slice1", torn);
  EXPECT_THAT(error(), HasSubstr("photometric"));
  const Volume part = read({.region = Region{{4, -9, 22}, {9, -6, 24}}});
  EXPECT_EQ(part.size[2], 4);  // 20, 22, 24, 26 mm
  EXPECT_LT(largest_ramp_error(part), kRounding_hu);
}

TEST_F(DicomRegionTest, OfAnUnevenTiltedStackIsThatPartOfTheWhole) {
  std::vector<double> along;
  for (int k = 0; k < 40; ++k) along.push_back(2 * k + (k > 20 ? 1 : 0));  // more than one piece
  add_stack(along, kUprightBox, 0.3 * kUprightBox.col(1));
  const Volume whole = read();
  const Volume part = read({.region = Region{{6, -2, 60}, {7, 6, 70}}});
  EXPECT_LT(part.voxels.size(), whole.voxels.size());
  for_each_voxel(part.size, [&](int i, int j, int k) {
    const Eigen::Vector3d index =
        whole.index_from_world(part.world_from_index(Eigen::Vector3d(i, j, k)));
    const Eigen::Vector3i at = index.array().round().cast<int>();
    EXPECT_EQ(part.at(i, j, k), whole.at(at.x(), at.y(), at.z()));
  });
}

TEST(Describe, NamesThePatientsSidesThatTheAxesRunTowards) {
  const auto orientation = [](const Eigen::Matrix3d& d) {
    return volume_figures(ramp_volume(d)).orientation;
  };
  const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  EXPECT_EQ(orientation(direction), "LPS");
  direction << -x, -y, z;
  EXPECT_EQ(orientation(direction), "RAS");
  direction << -z, x, -y;
  EXPECT_EQ(orientation(direction), "ILA");
  EXPECT_EQ(orientation(oblique_direction()), "LPS");
}

TEST(Describe, GivesTheFigures) {
  Volume volume = ramp_volume();
  volume.direction.col(1) *= -1;
  const VolumeFigures figures = volume_figures(volume);
  EXPECT_TRUE(figures.left_handed);
  EXPECT_NEAR(figures.oblique_degrees, 0, 1e-6);
  EXPECT_LT((figures.extent_mm - Eigen::Vector3d(4, 5, 9)).norm(), 1e-12);
  EXPECT_LT((figures.min_mm - Eigen::Vector3d(-40, 21.25, 110)).norm(), 1e-12);
  EXPECT_LT((figures.max_mm - Eigen::Vector3d(-36.8, 25, 116)).norm(), 1e-12);
  EXPECT_EQ(figures.range.max, value_range(volume).max);
}

using ::testing::Contains;
using ::testing::ElementsAre;
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
