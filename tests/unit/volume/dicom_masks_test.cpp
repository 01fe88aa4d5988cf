// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM files that are sound and such that are not, and the masks in them: segments, contours and
// their holes.
#include "dicom/dicom.h"

#include "mask_scans.h"
#include "organbake/volume/read_volume.h"
#include "support/testing.h"

namespace organbake {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class DicomStructure : public ::testing::Test {
 protected:
  std::string flaw(const std::string& bytes) {
    write_bytes(file_, bytes);
    return flaw_of_dicom(file_);
  }
  // A segmentation whose pixels are compressed: sequences within sequences, then fragments.
  static std::string segmentation() {
    return SegBytes{"FRACTIONAL", 8, {{1, 0, std::vector<int>(35, 150)}}, true}.bytes();
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "a.dcm";
};

// A padding value's kind hangs on whether pixels are signed: nobody is to hear of that.
TEST_F(DicomStructure, NothingIsSaidOnTheTerminal) {
  DicomBytes slice;
  slice.pixels.assign(12, 1000);
  slice.padding = 900;
  testing::internal::CaptureStderr();
  EXPECT_EQ(flaw(slice.bytes()), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

// Wherever a file ends too early, but between two elements that nothing holds together.
TEST_F(DicomStructure, WhatIsCutOffIsAFlaw) {
  const std::string whole = segmentation();
  const std::size_t sequences = whole.find(std::string("\x62\0\2\0SQ", 6));
  ASSERT_NE(sequences, whole.npos);
  int unseen = 0;
  for (std::size_t length = sequences; length < whole.size(); ++length)
    unseen += flaw(whole.substr(0, length)).empty();
  // Before each of the five elements from there on, and up to seven bytes into them.
  EXPECT_LE(unseen, 5 * 8);
}

TEST_F(DicomStructure, LyingLengthsAndEndlessNestingAreFlaws) {
  const std::string head = dicom_head("1.2.840.10008.5.1.4.1.1.66.4");
  EXPECT_THAT(flaw(head + dicom_element(0x62, 1, "CS", "BINARY").replace(6, 2, "\xF0\xFF")),
              HasSubstr("reaches beyond"));
  const std::string inner = dicom_element(0x62, 4, "US", "\1");
  std::string sequence = dicom_sequence(0x62, 2, {inner});
  EXPECT_EQ(flaw(head + sequence), "");
  EXPECT_THAT(flaw(head + dicom_sequence(0x62, 2, {inner}).replace(12, 4, "oops")),
              HasSubstr("something else than items"));
  for (int depth = 0; depth < 40; ++depth) sequence = dicom_sequence(0x62, 2, {sequence});
  EXPECT_THAT(flaw(head + sequence), HasSubstr("nested too deeply"));
}

std::vector<int> frame_with(std::initializer_list<int> set, int value = 1) {
  std::vector<int> values(35, 0);
  for (const int i : set) values[static_cast<std::size_t>(i)] = value;
  return values;
}

class DicomMasks : public VolumeFileTest {
 protected:
  DicomMasks() : VolumeFileTest("mask.dcm") {}

  Volume read(const std::string& bytes, const std::string& label = {}) const {
    return VolumeFileTest::read(bytes, {.label = label, .is_mask = true});
  }
  std::string error(const std::string& bytes, const std::string& label) const {
    return VolumeFileTest::error(bytes, {.label = label, .is_mask = true});
  }
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
  EXPECT_THAT(error(seg.bytes(), "spleen"), HasSubstr("1 liver, 2 cyst, large"));
  EXPECT_THAT(error(seg.bytes(), "3"), HasSubstr("no label 3"));
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
  error(bytes.substr(0, bytes.size() - 30), "liver");
  SegBytes bits{"BINARY", 1, {{1, 0, frame_with({3})}}};
  bits.rle = true;
  EXPECT_THAT(error(bits.bytes(), "liver"), HasSubstr("save it uncompressed"));
}

TEST_F(DicomMasks, ATruncatedOrUnevenSegmentationIsRefused) {
  const SegBytes seg{
      "BINARY", 1, {{1, 0, frame_with({3})}, {1, 2, frame_with({3})}, {1, 5, frame_with({3})}}};
  EXPECT_THAT(error(seg.bytes(), "1"), HasSubstr("uneven gaps"));
  SegBytes few = seg;
  few.frames.pop_back();
  std::string bytes = few.bytes();
  for (const std::size_t cut : {std::size_t{1}, std::size_t{6}, bytes.size() / 2}) {
    error(bytes.substr(0, bytes.size() - cut), "1");
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
  EXPECT_THAT(error(structure_set({{"empty", {}}}), "1"), HasSubstr("no closed contour"));
  EXPECT_THAT(error(structure_set(tubes()), "liver"), HasSubstr("4 own hole, 5 keyhole"));
}

class MaskFrames : public MaskPlanes {};

TEST_F(MaskFrames, OneOfSeveralPhasesIsAskedFor) {
  const Scan scan = scans().front();
  SegBytes seg = seg_of(scan, {4, 5, 6, 7});
  const SegBytes later = seg_of(scan, {6, 7, 8});
  for (SegBytes::Frame& frame : seg.frames) frame.phase = "1";
  for (SegBytes::Frame frame : later.frames) {
    frame.phase = "2";
    seg.frames.insert(seg.frames.begin() + 1, frame);
  }
  EXPECT_THAT(
      message_of(ExitCode::bad_data, [&] { read(seg.bytes(), nullptr); }),
      HasSubstr("2 time points, 1: temporal position 1, 4 frames; 2: temporal position 2, 3 "
                "frames; choose one with --time 1…2"));
  expect_like(read(seg.bytes(), nullptr, "liver", {.time = 1}), counted(scan, {4, 5, 6, 7}));
  expect_like(read(seg.bytes(), nullptr, "liver", {.time = 2}), counted(scan, {6, 7, 8}));
  const Volume look = read(seg.bytes(), nullptr, "liver", {.any_time = true});
  EXPECT_EQ(look.time_points, 2);
  EXPECT_THAT(look.warnings, Contains(HasSubstr("number 1 was taken")));
  EXPECT_THAT(
      message_of(ExitCode::usage, [&] { read(seg.bytes(), nullptr, "liver", {.time = 3}); }),
      HasSubstr("no --time 3"));
  // Its scan may have but one.
  ct_of(scan);
  EXPECT_EQ(read_volume(folder_.path() / "ct", {.time = 2, .lasting = true}).size[2], 20);
}

TEST_F(MaskFrames, TwoHalvesOfASegmentInOnePlaneAreUnited) {
  const Scan scan = scans().front();
  SegBytes seg = seg_of(scan, {4, 5, 6});
  const std::vector<SegBytes::Frame> whole = seg.frames;
  seg.frames.clear();
  for (const SegBytes::Frame& frame : whole) {
    SegBytes::Frame left = frame, right = frame;
    for (std::size_t i = 0; i < frame.values.size(); ++i)
      (i % Scan::kColumns < 20 ? right : left).values[i] = 0;
    seg.frames.insert(seg.frames.end(), {left, right});
  }
  const Volume mask = read(seg.bytes(), nullptr);
  expect_like(mask, counted(scan, {4, 5, 6}));
  EXPECT_THAT(mask.warnings, Contains(HasSubstr("they were united")));
}

TEST_F(MaskFrames, WhatNoGridHoldsIsRefusedByName) {
  const Scan scan = scans().front();
  const auto refused = [&](auto spoil) {
    SegBytes seg = seg_of(scan, {4, 5, 6});
    spoil(seg);
    return message_of(ExitCode::bad_data, [&] { read(seg.bytes(), nullptr); });
  };
  EXPECT_THAT(refused([](SegBytes& seg) { seg.frames[1].orientation = "1\\0\\0\\0\\0\\1"; }),
              HasSubstr("frame 2 has another orientation than the first"));
  EXPECT_THAT(refused([](SegBytes& seg) { seg.frames[2].pixel_spacing = "0.7\\0.9"; }),
              HasSubstr("frame 3 has another pixel spacing than the first"));
  EXPECT_THAT(refused([](SegBytes& seg) { seg.pixel_spacing = "0.7"; }),
              HasSubstr("frame 1 does not say its position, orientation or pixel spacing"));
  EXPECT_THAT(refused([](SegBytes& seg) { seg.frames[1].corner->z() += 1.3; }),
              HasSubstr("uneven gaps"));
  EXPECT_THAT(refused([](SegBytes& seg) {
                seg.frames[1].corner->y() += 9000;
                seg.frames[0].corner->x() -= 9000;
              }),
              HasSubstr("too far apart"));
}

TEST_F(MaskFrames, AnotherFrameOfReferenceIsSaid) {
  const Scan scan = scans().front();
  const Volume ct = ct_of(scan, "1.2.840.1");
  SegBytes seg = seg_of(scan, {4, 5, 6});
  Roi roi{"organ", {{scan.corner(4).z(), outline(scan, 4)}}};
  for (const char* uid : {"", "1.2.840.1"}) {
    seg.frame_of_reference = roi.frame_of_reference = uid;
    EXPECT_THAT(read(seg.bytes(), &ct).warnings, IsEmpty());
    EXPECT_THAT(read(structure_set({roi}), &ct, "organ").warnings, IsEmpty());
  }
  seg.frame_of_reference = roi.frame_of_reference = "1.2.840.2";
  EXPECT_THAT(read(seg.bytes(), &ct).warnings, Contains(HasSubstr("another frame of reference")));
  EXPECT_THAT(read(structure_set({roi}), &ct, "organ").warnings,
              Contains(HasSubstr("another frame of reference")));
}

Polygon2 disc_of(double x, double radius, bool backward = false) {
  Polygon2 points;
  constexpr int kPoints = 720;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = (backward ? -2 : 2) * M_PI * i / kPoints;
    points.emplace_back(x + radius * std::cos(angle), radius * std::sin(angle));
  }
  return points;
}

double area(const ContourRegion& region) {
  constexpr double kStep = 0.05;
  double sum = 0;
  for (double y = -60 + kStep / 2; y < 60; y += kStep)
    for (const auto& [from, to] : region.row(y)) sum += kStep * (to - from);
  return sum;
}

double disc(double radius) { return M_PI * radius * radius; }

// Of 180 points and rows: 1e-3 of the area.
constexpr double kTolerance = 1e-3;

TEST(ContourRegion, OverlappingContoursAreUnited) {
  const ContourRegion region({{disc_of(0, 25)}, {disc_of(25, 15)}});
  // Two circles' union, by the formula of their lens.
  const double r = 25, s = 15, d = 25;
  const double lens = r * r * std::acos((d * d + r * r - s * s) / (2 * d * r)) +
                      s * s * std::acos((d * d + s * s - r * r) / (2 * d * s)) -
                      0.5 * std::sqrt((-d + r + s) * (d + r - s) * (d - r + s) * (d + r + s));
  const double right = disc(25) + disc(15) - lens;
  EXPECT_NEAR(area(region) / right, 1, kTolerance);
  EXPECT_EQ(region.holes(), 0u);
}

TEST(ContourRegion, OneInsideAnotherIsAHoleAndOneInsideThatAnIsland) {
  const ContourRegion region({{disc_of(0, 10)}, {disc_of(0, 25)}, {disc_of(2, 4)}});
  EXPECT_NEAR(area(region) / (disc(25) - disc(10) + disc(4)), 1, kTolerance);
  EXPECT_EQ(region.holes(), 1u);
}

TEST(ContourRegion, AHoleInTwoThatOverlapIsAHole) {
  const ContourRegion region({{disc_of(-5, 25)}, {disc_of(5, 25)}, {disc_of(0, 6)}});
  const ContourRegion filled({{disc_of(-5, 25)}, {disc_of(5, 25)}});
  EXPECT_NEAR((area(filled) - area(region)) / disc(6), 1, kTolerance);
}

TEST(ContourRegion, TheSameContourTwiceCountsOnce) {
  Polygon2 again = disc_of(0, 25, true);
  std::rotate(again.begin(), again.begin() + 100, again.end());
  const ContourRegion region({{disc_of(0, 25)}, {again}});
  EXPECT_NEAR(area(region) / disc(25), 1, kTolerance);
  EXPECT_EQ(region.repeated(), 1u);
  EXPECT_EQ(region.holes(), 0u);
}

TEST(ContourRegion, ContoursOfOneEvenOddSetCutEachOther) {
  const ContourRegion region({{disc_of(0, 25), disc_of(0, 10)}});
  EXPECT_NEAR(area(region) / (disc(25) - disc(10)), 1, kTolerance);
}

}  // namespace
}  // namespace organbake
