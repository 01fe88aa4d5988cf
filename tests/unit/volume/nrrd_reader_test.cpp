// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/nrrd_reader.h"

#include <bzlib.h>
#include <gmock/gmock.h>

#include "organbake/core/temporary_folder.h"
#include "organbake/core/text.h"
#include "organbake/volume/read_volume.h"
#include "support/ramp_volume.h"

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
  for (int axis = 0; axis < 3; ++axis) {
    text += " " + vector_text(from_lps.cwiseProduct(v.direction.col(axis) * v.spacing_mm[axis]));
  }
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

class Nrrd : public ::testing::Test {
 protected:
  Volume read(const std::string& bytes) {
    write_bytes(file_, bytes);
    return read_volume(file_);
  }
  std::string error(const std::string& bytes) {
    return message_of(ExitCode::bad_data, [&] { read(bytes); });
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "scan.nrrd";
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
    write_bytes(file_, text + "\n" + bytes);
    return read_volume(file_, {.time = 2}).voxels;
  };
  const std::string space = "(0.8,0,0) (0,1.25,0) (0,0,3)";
  EXPECT_EQ(volume("2 5 4 3", "none " + space, side_by_side), truth_.voxels);
  EXPECT_EQ(volume("5 4 3 2", space + " none", std::string(raw_.size(), 'x') + raw_),
            truth_.voxels);
}

TEST_F(Nrrd, VoxelsMayBeSpreadOverFilesByListOrPattern) {
  const std::size_t slice = raw_.size() / 3;
  for (std::size_t k = 0; k < 3; ++k) {
    write_bytes(folder_.path() / ("s0" + std::to_string(k + 1) + ".raw"),
                raw_.substr(k * slice, slice));
  }
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

}  // namespace
}  // namespace organbake
