// SPDX-License-Identifier: GPL-3.0-or-later
// NRRD and MetaImage as programs write them: places, types, packed, apart and in parts.
#include "files/volume_files.h"

#include <bzlib.h>

#include "organbake/core/text.h"
#include "support/testing.h"
#include "volume_fixtures.h"

namespace organbake {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kNrrdRounding_hu = 0.5 + 1e-6;

std::string vector_text(const Eigen::Vector3d& v) {
  return "(" + to_text(v.x()) + "," + to_text(v.y()) + "," + to_text(v.z()) + ")";
}

// The place of a volume as NRRD writes it in a space whose axes are `from_lps` times LPS.
std::string place_in(const std::string& space, const Eigen::Vector3d& from_lps, const Volume& v) {
  std::string text = "space: " + space + "\nspace directions:";
  for (int axis = 0; axis < 3; ++axis)
    text += " " + vector_text(from_lps.cwiseProduct(v.direction.col(axis) * v.spacing_mm[axis]));
  return text + "\nspace origin: " + vector_text(from_lps.cwiseProduct(v.origin_mm)) + "\n";
}

std::string nrrd_text(const std::string& place, const std::string& more = "encoding: raw\n") {
  return "NRRD0004\n# a comment\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\n" +
         place + more;
}

std::string bzipped(const std::string& bytes) {
  std::string out(bytes.size() + 1000, '\0');
  auto length = static_cast<unsigned>(out.size());
  BZ2_bzBuffToBuffCompress(out.data(), &length, const_cast<char*>(bytes.data()),
                           static_cast<unsigned>(bytes.size()), 9, 0, 0);
  return out.substr(0, length);
}

class Nrrd : public VolumeFileTest {
 protected:
  Nrrd() : VolumeFileTest("scan.nrrd") {}

  Volume truth_ = ramp_volume(oblique_direction());
  std::string raw_ = voxel_bytes(truth_);
  std::string place_ = place_in("left-posterior-superior", {1, 1, 1}, truth_);
};

TEST_F(Nrrd, EverySpacePutsEveryVoxelInItsPlaceInTheWorld) {
  for (const auto& [space, from_lps] :
       {std::pair<const char*, Eigen::Vector3d>{"left-posterior-superior", {1, 1, 1}},
        {"LPS", {1, 1, 1}},
        {"right-anterior-superior", {-1, -1, 1}},
        {"RAS", {-1, -1, 1}},
        {"left-anterior-superior", {1, -1, 1}}}) {
    const Volume volume = read(nrrd_text(place_in(space, from_lps, truth_)) + "\n" + raw_);
    EXPECT_LT(largest_ramp_error(volume), kNrrdRounding_hu) << space;
    EXPECT_THAT(volume.warnings, IsEmpty());
  }
}

TEST_F(Nrrd, AnUnknownSpaceIsTakenAsLpsWithAWarning) {
  const Volume volume = read(nrrd_text(place_in("scanner-xyz", {1, 1, 1}, truth_)) + "\n" + raw_);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("LPS was assumed")));
}

TEST_F(Nrrd, ReadsEveryEncoding) {
  const auto voxels = [&](const std::string& more, const std::string& data) {
    return read(nrrd_text(place_, more) + "\n" + data).voxels;
  };
  EXPECT_EQ(voxels("encoding: gzip\n", gzipped(raw_)), truth_.voxels);
  EXPECT_EQ(voxels("encoding: bz2\n", bzipped(raw_)), truth_.voxels);
  EXPECT_EQ(voxels("encoding: raw\nbyte skip: 5\n", "12345" + raw_), truth_.voxels);
  EXPECT_EQ(voxels("encoding: raw\nbyte skip: -1\n", "any header" + raw_), truth_.voxels);
  EXPECT_EQ(voxels("encoding: gz\nbyte skip: -1\n", gzipped("any header" + raw_)), truth_.voxels);
  EXPECT_EQ(voxels("encoding: gz\nline skip: 2\n", "one\ntwo\n" + gzipped(raw_)), truth_.voxels);
  std::string text;
  for (const std::int16_t v : truth_.voxels) text += std::to_string(v) + "\n";
  EXPECT_EQ(voxels("encoding: ascii\n", text), truth_.voxels);
}

TEST_F(Nrrd, ReadsADetachedHeader) {
  write_bytes(folder_.path() / "scan.raw", raw_);
  write_bytes(folder_.path() / "scan.nhdr", nrrd_text(place_) + "data file: scan.raw\n");
  EXPECT_EQ(read_volume(folder_.path() / "scan.nhdr").voxels, truth_.voxels);
  write_bytes(folder_.path() / "scan.nhdr", nrrd_text(place_) + "data file: gone.raw\n");
  EXPECT_THAT(message_of(ExitCode::no_input, [&] { read_volume(folder_.path() / "scan.nhdr"); }),
              HasSubstr("gone.raw"));
}

TEST_F(Nrrd, AFourthAxisOfOneIsDropped) {
  std::string text = nrrd_text("space: LPS\nspace directions: none (0.8,0,0) (0,1.25,0) (0,0,3)\n");
  text.replace(text.find("dimension: 3"), 12, "dimension: 4");
  text.replace(text.find("sizes: 5"), 8, "sizes: 1 5");
  EXPECT_EQ(read(text + "\n" + raw_).size, (std::array<int, 3>{5, 4, 3}));
  text.replace(text.find("sizes: 1 5 4 3"), 14, "sizes: 2 5 4 3");
  EXPECT_THAT(error(text + "\n" + raw_ + raw_), HasSubstr("holds 2 time points"));
}

TEST_F(Nrrd, OneOfSeveralVolumesIsChosenWhetherTheyStandSideBySideOrOneAfterTheOther) {
  std::string side_by_side;
  for (const std::int16_t v : truth_.voxels) {
    const std::int16_t pair[2] = {0, v};
    side_by_side.append(reinterpret_cast<const char*>(pair), 4);
  }
  const auto volume = [&](const std::string& sizes, const std::string& directions,
                          const std::string& bytes) {
    std::string text = nrrd_text("space: LPS\nspace directions: " + directions + "\n");
    text.replace(text.find("dimension: 3"), 12, "dimension: 4");
    text.replace(text.find("sizes: 5 4 3"), 12, "sizes: " + sizes);
    return read(text + "\n" + bytes, {.time = 2}).voxels;
  };
  const std::string space = "(0.8,0,0) (0,1.25,0) (0,0,3)";
  EXPECT_EQ(volume("2 5 4 3", "none " + space, side_by_side), truth_.voxels);
  EXPECT_EQ(volume("5 4 3 2", space + " none", std::string(raw_.size(), 'x') + raw_),
            truth_.voxels);
}

TEST_F(Nrrd, VoxelsMayBeSpreadOverFilesByListOrPattern) {
  const std::size_t slice = raw_.size() / 3;
  for (std::size_t k = 0; k < 3; ++k)
    write_bytes(folder_.path() / ("s0" + std::to_string(k + 1) + ".raw"),
                raw_.substr(k * slice, slice));
  const auto read_header = [&](const std::string& data_file) {
    write_bytes(folder_.path() / "scan.nhdr", nrrd_text(place_) + data_file);
    return read_volume(folder_.path() / "scan.nhdr").voxels;
  };
  EXPECT_EQ(read_header("data file: LIST\ns01.raw\ns02.raw\ns03.raw\n"), truth_.voxels);
  EXPECT_EQ(read_header("data file: s%02d.raw 1 3 1\n"), truth_.voxels);
  EXPECT_THAT(message_of(ExitCode::no_input, [&] { read_header("data file: s%02d.raw 1 6 2\n"); }),
              HasSubstr("s05.raw"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_header("data file: s%n.raw 1 3 1\n"); }),
              HasSubstr("is no pattern"));
}

TEST_F(Nrrd, RefusesBadHeaders) {
  const auto with = [&](const std::string& what, const std::string& instead) {
    std::string text = nrrd_text(place_) + "\n" + raw_;
    text.replace(text.find(what), what.size(), instead);
    return error(text);
  };
  EXPECT_THAT(with("type: short", "type: block"), HasSubstr("\"block\""));
  EXPECT_THAT(with("encoding: raw", "encoding: hex"), HasSubstr("\"hex\""));
  EXPECT_THAT(with("endian: little", "endian: middle"), HasSubstr("little or big"));
  EXPECT_THAT(with("dimension: 3", "dimension: 2"), HasSubstr("3 sizes for dimension 2"));
  EXPECT_THAT(with("sizes: 5 4 3", "sizes: 5 4 -3"), HasSubstr("a side of -3"));
  EXPECT_THAT(with("sizes: 5 4 3", "sizes: 5 4 9"), HasSubstr("truncated"));
  EXPECT_THAT(with("sizes: 5 4 3", "sizes: 5 4 2"), HasSubstr("more data"));
  EXPECT_THAT(with("encoding: raw", "byte skip: -5\nencoding: raw"), HasSubstr("skip of -5"));
  EXPECT_THAT(with("# a comment", "no colon here"), HasSubstr("no colon"));
  EXPECT_THAT(with("# a comment", "space units: \"um\" \"um\" \"um\""), HasSubstr("millimetres"));
  EXPECT_THAT(with("space directions: (", "space directions: none (1,0,0) ("),
              HasSubstr("space directions"));
}

struct RealFile {
  const char* name;
  bool readable;
};
class NrrdRealData : public ::testing::TestWithParam<RealFile> {};

// The ball of pynrrd's own tests: every way of storing it gives the same voxels.
TEST_P(NrrdRealData, OpensOrIsRefused) {
  const std::string folder = "robustness/nrrd/";
  REQUIRE_SHARED_DATA(folder);
  const auto file = shared_data(folder + GetParam().name);
  if (!GetParam().readable) {
    message_of(ExitCode::bad_data, [&] { read_volume(file); });
    return;
  }
  const Volume ball = read_volume(shared_data(folder + "BallBinary30x30x30.nrrd"));
  const Volume volume = read_volume(file);
  EXPECT_EQ(volume.voxels, ball.voxels);
  EXPECT_TRUE(same_grid(volume, ball));
}

INSTANTIATE_TEST_SUITE_P(
    Pynrrd, NrrdRealData,
    ::testing::Values(
        RealFile{"BallBinary30x30x30.nhdr", true}, RealFile{"BallBinary30x30x30.nii.gz", true},
        RealFile{"BallBinary30x30x30_byteskip_minus_one.nhdr", true},
        RealFile{"BallBinary30x30x30_byteskip_minus_one_nifti.nhdr", true},
        RealFile{"BallBinary30x30x30_bz2.nrrd", true}, RealFile{"BallBinary30x30x30_gz.nrrd", true},
        RealFile{"BallBinary30x30x30_gz_byteskip_minus_one.nrrd", true},
        RealFile{"BallBinary30x30x30_gz_lineskip.nrrd", true},
        RealFile{"BallBinary30x30x30_byteskip_minus_five.nhdr", false},
        RealFile{"BallBinary30x30x30_nifti.nhdr", false}, RealFile{"BallBinary30x30x30.raw", false},
        RealFile{"test1d_ascii.nrrd", false}, RealFile{"test2d_ascii.nrrd", false},
        RealFile{"test_customFields.nrrd", false}));

constexpr double kExactPlace_hu = 0.5 + 1e-9;

std::string header(const std::string& more, const std::string& last = "ElementDataFile = LOCAL\n") {
  return "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementSpacing = 0.8 1.25 3\n"
         "Offset = -40 25 110\nElementType = MET_SHORT\n" +
         more + last;
}

class MetaImage : public VolumeFileTest {
 protected:
  MetaImage() : VolumeFileTest("scan.mha") {}

  std::string raw_ = voxel_bytes(ramp_volume());
};

TEST_F(MetaImage, WhatIsWrittenIsReadBackExactly) {
  Eigen::Matrix3d mirrored = oblique_direction();
  mirrored.col(1) *= -1;
  for (const Eigen::Matrix3d& direction :
       {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), oblique_direction(), mirrored}) {
    const Volume truth = ramp_volume(direction);
    write_metaimage(file_, truth);
    const Volume volume = read_volume(file_);
    EXPECT_EQ(volume.voxels, truth.voxels);
    EXPECT_EQ(volume.spacing_mm, truth.spacing_mm);
    EXPECT_EQ(volume.origin_mm, truth.origin_mm);
    EXPECT_LT((volume.direction - truth.direction).norm(), 1e-14);
    EXPECT_LT(largest_ramp_error(volume), kExactPlace_hu);
  }
}

TEST_F(MetaImage, ReadsRawTextAndDetachedData) {
  const Volume truth = ramp_volume();
  EXPECT_EQ(read(header("BinaryData = True\n") + raw_).voxels, truth.voxels);
  std::string text;
  for (const std::int16_t v : truth.voxels) text += std::to_string(v) + " ";
  EXPECT_EQ(read(header("BinaryData = False\n") + text).voxels, truth.voxels);
  write_bytes(folder_.path() / "scan.raw", "sixteen bytes..." + raw_);
  write_bytes(folder_.path() / "scan.mhd",
              header("HeaderSize = -1\n", "ElementDataFile = scan.raw\n"));
  EXPECT_EQ(read_volume(folder_.path() / "scan.mhd").voxels, truth.voxels);
}

TEST_F(MetaImage, VoxelsMayBeSpreadOverFilesByListOrPattern) {
  const std::size_t slice = raw_.size() / 3;
  for (std::size_t k = 0; k < 3; ++k)
    write_bytes(folder_.path() / ("s" + std::to_string(k) + ".raw"), raw_.substr(k * slice, slice));
  const auto truth = ramp_volume().voxels;
  EXPECT_EQ(read(header("", "ElementDataFile = LIST\ns0.raw\ns1.raw\ns2.raw\n")).voxels, truth);
  EXPECT_EQ(read(header("", "ElementDataFile = s%d.raw 0 2 1\n")).voxels, truth);
  write_bytes(folder_.path() / "s1.raw", "short");
  EXPECT_THAT(error(header("", "ElementDataFile = s%d.raw 0 2 1\n")), HasSubstr("truncated"));
}

TEST_F(MetaImage, OneOfSeveralTimePointsIsChosen) {
  const std::string four =
      "NDims = 4\nDimSize = 5 4 3 2\nElementSpacing = 0.8 1.25 3 1\nOffset = -40 25 110 0\n"
      "TransformMatrix = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\nElementType = MET_SHORT\n"
      "ElementDataFile = LOCAL\n";
  const std::string both = four + std::string(raw_.size(), 'x') + raw_;
  const Volume second = read(both, {.time = 2});
  EXPECT_EQ(second.voxels, ramp_volume().voxels);
  EXPECT_TRUE(same_grid(second, ramp_volume()));
  EXPECT_THAT(error(both), HasSubstr("holds 2 time points"));
}

TEST_F(MetaImage, TransformMatrixListsTheAxesOneAfterTheOther) {
  // Index axis 0 runs along +y, axis 1 along −x: the first three numbers are axis 0's direction.
  const Volume volume = read(header("TransformMatrix = 0 1 0 -1 0 0 0 0 1\n") + raw_);
  EXPECT_EQ(volume.direction.col(0), Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(volume.direction.col(1), Eigen::Vector3d(-1, 0, 0));
}

TEST_F(MetaImage, WithoutSpacingOneMillimetreIsAssumedWithAWarning) {
  const Volume volume = read(
      "NDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\n"
      "ElementDataFile = LOCAL\n" +
      raw_);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("1 mm was assumed")));
}

TEST_F(MetaImage, RefusesBadHeaders) {
  EXPECT_THAT(error("hello"), HasSubstr("no ElementDataFile"));
  EXPECT_THAT(error(header("NDims = 2\n") + raw_), HasSubstr("has 2 dimensions"));
  EXPECT_THAT(error(header("DimSize = 5 4\n") + raw_), HasSubstr("3-D volume is needed"));
  EXPECT_THAT(error(header("DimSize = 5 4 x\n") + raw_), HasSubstr("not a list of numbers"));
  EXPECT_THAT(error(header("DimSize = 5 4 0\n") + raw_), HasSubstr("a side of 0 voxels"));
  EXPECT_THAT(error(header("ElementType = MET_STRING\n") + raw_), HasSubstr("MET_STRING"));
  EXPECT_THAT(error(header("ElementNumberOfChannels = 3\n") + raw_), HasSubstr("channels"));
  EXPECT_THAT(error(header("ElementSpacing = 1 -1 0\n") + raw_), HasSubstr("spacing along axis 2"));
  EXPECT_THAT(error(header("TransformMatrix = 1 0 0 0 1 0 0 0\n") + raw_), HasSubstr("9 numbers"));
  EXPECT_THAT(error(header("TransformMatrix = 1 0 0 1 0 0 0 0 1\n") + raw_), HasSubstr("sheared"));
  EXPECT_THAT(error(header("DimSize = 60000 60000 9\n") + raw_), HasSubstr("limit"));
  EXPECT_THAT(error(header("DimSize = 2000 2000 9\n") + raw_), HasSubstr("truncated"));
  EXPECT_THAT(error(header("CompressedData = True\n") + raw_), HasSubstr("damaged"));
  EXPECT_THAT(error(header("", "ElementDataFile = LIST\n")), HasSubstr("names 0 files"));
  EXPECT_THAT(error(header("") + raw_ + "more"), HasSubstr("more data than its header"));
}

TEST_F(MetaImage, NamesAMissingDataFile) {
  EXPECT_THAT(error(header("", "ElementDataFile = gone.raw\n"), {}, ExitCode::no_input),
              HasSubstr("gone.raw"));
}

TEST(MetaImageRealData, LungOpens) {
  REQUIRE_SHARED_DATA("ct/lung/3DCT_lung_baseline_small.mha");
  const Volume lung = read_volume(shared_data("ct/lung/3DCT_lung_baseline_small.mha"));
  EXPECT_EQ(lung.size, (std::array<int, 3>{57, 78, 64}));
  EXPECT_EQ(lung.origin_mm, Eigen::Vector3d(-152.461, -148.986, -1432));
  EXPECT_LT(value_range(lung).min, -1000);
  const Volume mask = read_volume(shared_data("ct/lung/3DCT_lung_baseline_mask.mha"));
  EXPECT_EQ(count_labels(mask).size(), 1u);
}

}  // namespace
}  // namespace organbake
