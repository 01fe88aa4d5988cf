// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_masks.h"

#include <gmock/gmock.h>

#include "dicom_folder_fixture.h"
#include "organbake/volume/label_figures.h"
#include "support/dicom_bytes.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::vector<int> frame_with(std::initializer_list<int> set, int value = 1) {
  std::vector<int> values(35, 0);
  for (const int i : set) values[static_cast<std::size_t>(i)] = value;
  return values;
}

class DicomMasks : public ::testing::Test {
 protected:
  Volume read(const std::string& bytes, const std::string& label = {}) {
    write_bytes(file_, bytes);
    return read_volume(file_, {.label = label, .is_mask = true});
  }

  TemporaryFolder folder_;
  fs::path file_ = folder_.path() / "mask.dcm";
};

TEST_F(DicomMasks, SegmentsOverlapKeepTheirNamesAndLieWhereTheirFramesDo) {
  // The planes at 3 and 9 mm have no frame of the liver's: there is nothing of it.
  const SegBytes seg{"BINARY",
                     1,
                     {{1, 12, frame_with({8, 9, 34})},
                      {2, 6, frame_with({9})},
                      {1, 6, frame_with({9, 10})},
                      {2, 3, frame_with({0})}}};
  const Volume liver = read(seg.bytes(), "liver");
  EXPECT_EQ(liver.size, (std::array<int, 3>{7, 5, 4}));
  EXPECT_EQ(liver.spacing_mm, Eigen::Vector3d(0.75, 0.5, 3));
  EXPECT_EQ(liver.origin_mm, Eigen::Vector3d(10, -20, 3));
  EXPECT_EQ(label_figures(liver)[0].voxels, 5u);
  EXPECT_EQ(liver.at(1, 1, 3), 1);
  EXPECT_EQ(liver.at(6, 4, 3), 1) << "the last bit of a frame";
  EXPECT_EQ(liver.at(2, 1, 1), 1);
  EXPECT_EQ(liver.at(0, 0, 0), 0);
  const Volume cyst = read(seg.bytes(), "cyst, large");
  EXPECT_EQ(label_figures(cyst)[0].voxels, 2u);
  EXPECT_EQ(label_figures(cyst)[0].label, 2);
  EXPECT_EQ(label_figures(read(seg.bytes(), "1,2"))[0].voxels, 6u) << "together";
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(seg.bytes(), "spleen"); }),
              HasSubstr("1 liver, 2 cyst, large"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(seg.bytes(), "3"); }),
              HasSubstr("no label 3"));
}

TEST_F(DicomMasks, AFolderWithOneMaskStandsForIt) {
  const SegBytes seg{"BINARY", 1, {{1, 0, frame_with({3})}, {1, 2, frame_with({3, 4})}}};
  const Volume alone = read(seg.bytes(), "liver");
  const auto from_folder = [&] {
    return read_volume(folder_.path(), {.label = "liver", .is_mask = true});
  };
  EXPECT_EQ(from_folder().voxels, alone.voxels);
  write_bytes(folder_.path() / "other.dcm", seg.bytes());
  EXPECT_THAT(message_of(ExitCode::bad_data, from_folder), HasSubstr("holds 2 masks (mask.dcm, o"));
}

TEST_F(DicomMasks, AFractionalSegmentIsInsideFromOneHalfOn) {
  SegBytes seg{"FRACTIONAL", 8, {{1, 0, frame_with({3}, 99)}, {1, 2, frame_with({3, 4}, 100)}}};
  EXPECT_EQ(label_figures(read(seg.bytes(), "1"))[0].voxels, 2u);
}

TEST_F(DicomMasks, FramesCompressedByRunLengthsAreRead) {
  SegBytes seg{
      "FRACTIONAL",
      8,
      {{1, 0, frame_with({3, 20}, 200)}, {2, 0, frame_with({0, 34}, 150)}, {1, 2, frame_with({})}}};
  const Volume plain = read(seg.bytes(), "liver");
  seg.rle = true;
  EXPECT_EQ(read(seg.bytes(), "liver").voxels, plain.voxels);
  EXPECT_EQ(label_figures(read(seg.bytes(), "cyst, large"))[0].voxels, 2u);
  const std::string bytes = seg.bytes();
  message_of(ExitCode::bad_data, [&] { read(bytes.substr(0, bytes.size() - 30), "liver"); });
  SegBytes bits{"BINARY", 1, {{1, 0, frame_with({3})}}};
  bits.rle = true;
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(bits.bytes(), "liver"); }),
              HasSubstr("save it uncompressed"));
}

TEST_F(DicomMasks, ATruncatedOrUnevenSegmentationIsRefused) {
  const SegBytes seg{
      "BINARY", 1, {{1, 0, frame_with({3})}, {1, 2, frame_with({3})}, {1, 5, frame_with({3})}}};
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(seg.bytes(), "1"); }),
              HasSubstr("uneven gaps"));
  SegBytes few = seg;
  few.frames.pop_back();
  std::string bytes = few.bytes();
  for (const std::size_t cut : {std::size_t{1}, std::size_t{6}, bytes.size() / 2}) {
    message_of(ExitCode::bad_data, [&] { read(bytes.substr(0, bytes.size() - cut), "1"); });
  }
}

std::vector<Eigen::Vector2d> circle(double x, double y, double radius, int points = 180) {
  std::vector<Eigen::Vector2d> all;
  for (int i = 0; i < points; ++i) {
    const double angle = 2 * M_PI * i / points;
    all.emplace_back(x + radius * std::cos(angle), y + radius * std::sin(angle));
  }
  return all;
}

// A tube of 15 planes at 2 mm, its hole once as a contour of its own, once by keyhole.
std::vector<Roi> tubes() {
  Roi own{"own hole", {}}, keyhole{"keyhole", {}};
  for (int k = 0; k < 15; ++k) {
    const double z = 100 + 2 * k;
    own.contours.push_back({z, circle(5, -30, 25)});
    own.contours.push_back({z, circle(5, -30, 10)});
    std::vector<Eigen::Vector2d> outer = circle(5, -30, 25), inner = circle(5, -30, 10);
    outer.push_back(outer.front());
    outer.insert(outer.end(), inner.rbegin(), inner.rend());
    outer.push_back(inner.back());
    keyhole.contours.push_back({z, outer});
  }
  return {own, keyhole};
}

TEST_F(DicomMasks, ContoursWithHolesAndKeyholesHaveTheirVolumeAndPlace) {
  const double right_ml = M_PI * (25 * 25 - 10 * 10) * 30 / 1000;
  for (const char* name : {"own hole", "keyhole"}) {
    const Volume mask = read(structure_set(tubes()), name);
    const LabelFigures figures = label_figures(mask)[0];
    EXPECT_NEAR(figures.volume_ml / right_ml, 1, 0.005) << name << ": the target is 1 %";
    const Eigen::Vector3d centre = (figures.min_mm + figures.max_mm) / 2;
    EXPECT_LT((centre - Eigen::Vector3d(5, -30, 114)).norm(), 0.15) << "a voxel's half, in x and y";
  }
}

TEST_F(DicomMasks, ObliqueContoursKeepTheirPlanes) {
  const Volume mask = read(structure_set(tubes(), oblique_direction()), "own hole");
  const double right_ml = M_PI * (25 * 25 - 10 * 10) * 30 / 1000;
  EXPECT_NEAR(label_figures(mask)[0].volume_ml / right_ml, 1, 0.01);
  EXPECT_NEAR(mask.direction.col(2).dot(oblique_direction().col(2)), 1, 1e-6);
}

TEST_F(DicomMasks, PlanesFarApartLeaveAGapAndOneMissingPlaneDoesNot) {
  Roi two{"two", {}};
  for (const double z : {0.0, 2.0, 4.0, 8.0, 10.0, 30.0, 32.0})
    two.contours.push_back({z, circle(0, 0, 10)});
  const Volume mask = read(structure_set({two}), "two");
  const auto at = [&](double z) {
    const Eigen::Vector3d index = mask.index_from_world({0, 0, z});
    return mask.at(static_cast<int>(std::lround(index.x())),
                   static_cast<int>(std::lround(index.y())),
                   static_cast<int>(std::lround(index.z())));
  };
  EXPECT_EQ(at(2), 4);
  EXPECT_EQ(at(6), 4) << "the plane that is missing";
  EXPECT_EQ(at(12), 0);
  EXPECT_EQ(at(20), 0);
  EXPECT_EQ(at(30), 4);
}

TEST_F(DicomMasks, LumpsATorsoApartAreOneRegion) {
  Roi nodes{"nodes", {}};
  for (const double z : {0.0, 2.0, 4.0, 600.0, 602.0, 604.0})
    nodes.contours.push_back({z, circle(0, 0, 10)});
  const LabelFigures figures = label_figures(read(structure_set({nodes}), "nodes"))[0];
  EXPECT_NEAR(figures.volume_ml / (2 * 3 * 2 * M_PI * 10 * 10 / 1000), 1, 0.01);
}

// Three points a plane are no reason for a gigabyte; many points have the grid they always had.
TEST_F(DicomMasks, AFewTrianglesOverATorsoAskForLittle) {
  Roi triangles{"triangles", {}}, circles{"circles", {}};
  for (int k = 0; k < 400; ++k) {
    triangles.contours.push_back({2.0 * k, {{-250, -150}, {250, -150}, {0, 250}}});
    if (k < 100) circles.contours.push_back({2.0 * k, circle(0, 0, 200)});
  }
  const Volume sparse = read(structure_set({triangles}), "triangles");
  constexpr std::size_t kAlwaysFits = 30'000'000;  // voxels
  EXPECT_LT(sparse.voxel_count(), kAlwaysFits);
  EXPECT_NEAR(label_figures(sparse)[0].volume_ml / (400 * 2 * 0.5 * 500 * 400 / 1000), 1, 0.02);
  const Volume dense = read(structure_set({circles}), "circles");
  EXPECT_NEAR(dense.spacing_mm.x(), 400.0 / 600, 0.01);
}

TEST_F(DicomMasks, WithoutClosedContoursThereIsNoMask) {
  EXPECT_THAT(message_of(ExitCode::bad_data,
                         [&] {
                           read(structure_set({{"empty", {}}}), "1");
                         }),
              HasSubstr("no closed contour"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(structure_set(tubes()), "liver"); }),
              HasSubstr("4 own hole, 5 keyhole"));
}

}  // namespace
}  // namespace organbake
