// SPDX-License-Identifier: GPL-3.0-or-later
// Masks lie where their planes lie, and are as thick as these: on straight, tilted, oblique and
// uneven scans, of all frames, of few, of one, and of frames that are cropped each for itself.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "organbake/volume/labels.h"
#include "organbake/volume/read_volume.h"
#include "support/files.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// The issue's: half a voxel's share is what rounding a plane to whole pixels costs at most.
constexpr double kCentre_mm = 0.1, kVolumeShare = 0.005;

std::string text_of(const Eigen::Matrix3d& axes) {
  std::string text;
  for (int i = 0; i < 6; ++i) text += (i ? "\\" : "") + to_text(axes(i % 3, i / 3), 10);
  return text;
}

// A scan of 40×36 pixels of 0.8×0.7 mm.
struct Scan {
  static constexpr int kColumns = 40, kRows = 36;
  std::string name;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  std::vector<double> along;                        // of each slice on the normal
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();  // per mm along the normal

  Eigen::Vector3d corner(int k) const {
    return Eigen::Vector3d(-17.5, 12.25, 40) + along[std::size_t(k)] * (axes.col(2) + drift);
  }
  Eigen::Vector3d world(double column, double row, int k) const {
    return corner(k) + 0.8 * column * axes.col(0) + 0.7 * row * axes.col(1);
  }
  // Half-way to the slices beside.
  double low(int k) const {
    const auto i = std::size_t(k);
    return k == 0 ? along[0] - (along[1] - along[0]) / 2 : (along[i - 1] + along[i]) / 2;
  }
  double high(int k) const {
    const auto i = std::size_t(k);
    return i + 1 == along.size() ? along[i] + (along[i] - along[i - 1]) / 2
                                 : (along[i] + along[i + 1]) / 2;
  }
};

std::vector<double> evenly(double gap, int count = 20) {
  std::vector<double> along;
  for (int k = 0; k < count; ++k) along.push_back(gap * k);
  return along;
}

std::vector<Scan> scans() {
  std::vector<Scan> all = {{"straight", Eigen::Matrix3d::Identity(), evenly(3)},
                           {"oblique", oblique_direction(), evenly(2.5)}};
  for (const double degrees : {25.0, -25.0, 8.0}) {
    // The table moves along z while the planes are tilted round x.
    const double tilt = degrees * M_PI / 180;
    Scan scan{"tilted by " + to_text(degrees, 0), Eigen::Matrix3d::Identity(), evenly(3)};
    scan.axes = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
    scan.drift = Eigen::Vector3d(0, 0, 1 / std::cos(tilt)) - scan.axes.col(2);
    all.push_back(scan);
  }
  Scan uneven{"uneven", Eigen::Matrix3d::Identity(), {}};
  for (int k = 0; k < 20; ++k) uneven.along.push_back(k < 10 ? 4.0 * k : 36 + 7.0 * (k - 9));
  all.push_back(uneven);
  return all;
}

// An organ that wanders from slice to slice: a disc of pixels in each.
bool in_organ(double column, double row, int k) {
  const double x = column - 18 - 0.3 * k, y = row - 17 + 0.2 * k;
  return x * x + y * y <= 64 + 4 * (k % 5);
}

struct Truth {
  double ml = 0;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
};

// By counting voxels.
Truth counted(const Scan& scan, const std::vector<int>& slices) {
  Truth truth;
  for (const int k : slices) {
    const double voxel = 0.8 * 0.7 * (scan.high(k) - scan.low(k));
    const double middle = (scan.high(k) + scan.low(k)) / 2 - scan.along[std::size_t(k)];
    for (int row = 0; row < Scan::kRows; ++row) {
      for (int column = 0; column < Scan::kColumns; ++column) {
        if (!in_organ(column, row, k)) continue;
        truth.ml += voxel / 1000;
        truth.centre_mm += voxel / 1000 * (scan.world(column, row, k) + middle * scan.axes.col(2));
      }
    }
  }
  truth.centre_mm /= truth.ml;
  return truth;
}

Truth measured(const Volume& mask) {
  Truth found;
  const double voxel = mask.spacing_mm.prod() / 1000;
  for_each_voxel(mask.size, [&](int i, int j, int k) {
    if (mask.at(i, j, k) == 0) return;
    found.ml += voxel;
    found.centre_mm += voxel * mask.world_from_index({double(i), double(j), double(k)});
  });
  found.centre_mm /= found.ml;
  return found;
}

void expect_like(const Volume& mask, const Truth& truth) {
  const Truth found = measured(mask);
  EXPECT_NEAR(found.ml / truth.ml, 1, kVolumeShare);
  EXPECT_LT((found.centre_mm - truth.centre_mm).norm(), kCentre_mm)
      << found.centre_mm.transpose() << " for " << truth.centre_mm.transpose();
}

const std::vector<std::pair<std::string, std::vector<int>>>& selections() {
  static const std::vector<std::pair<std::string, std::vector<int>>> all = {
      {"all", {3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14}},
      {"every second", {4, 6, 8, 10, 12, 14}},
      {"sparse", {5, 7, 10, 13}},
      {"far apart", {1, 18}},
      {"single", {9}}};
  return all;
}

class MaskPlanes : public ::testing::Test {
 protected:
  Volume ct_of(const Scan& scan, const std::string& frame_of_reference = {}) {
    const fs::path folder = folder_.path() / "ct";
    fs::remove_all(folder);
    fs::create_directory(folder);
    for (int k = 0; k < static_cast<int>(scan.along.size()); ++k) {
      DicomBytes slice;
      slice.set_position(scan.corner(k));
      slice.orientation = text_of(scan.axes);
      slice.pixel_spacing = "0.7\\0.8";
      slice.columns = Scan::kColumns;
      slice.rows = Scan::kRows;
      slice.frame_of_reference = frame_of_reference;
      slice.pixels.assign(std::size_t(Scan::kColumns) * Scan::kRows, 1074);
      write_bytes(folder / (std::to_string(k) + ".dcm"), slice.bytes());
    }
    return read_volume(folder);
  }
  Volume read(const std::string& bytes, const Volume* scan, const std::string& label = "liver",
              VolumeReadOptions options = {}) {
    write_bytes(file_, bytes);
    options.label = label;
    options.is_mask = true;
    options.scan = scan;
    return read_volume(file_, options);
  }

  TemporaryFolder folder_;
  fs::path file_ = folder_.path() / "mask.dcm";
};

SegBytes empty_seg(const Scan& scan) {
  SegBytes seg;
  seg.columns = Scan::kColumns;
  seg.rows = Scan::kRows;
  seg.orientation = text_of(scan.axes);
  seg.pixel_spacing = "0.7\\0.8";
  return seg;
}

SegBytes seg_of(const Scan& scan, const std::vector<int>& slices) {
  SegBytes seg = empty_seg(scan);
  for (const int k : slices) {
    SegBytes::Frame frame{1, 0, {}, scan.corner(k)};
    for (int row = 0; row < Scan::kRows; ++row)
      for (int column = 0; column < Scan::kColumns; ++column)
        frame.values.push_back(in_organ(column, row, k));
    seg.frames.push_back(frame);
  }
  std::reverse(seg.frames.begin(), seg.frames.end());  // their order means nothing
  return seg;
}

// Frames as large as the organ, each from a corner of its own.
SegBytes cropped_seg_of(const Scan& scan, const std::vector<int>& slices) {
  SegBytes seg = empty_seg(scan);
  seg.columns = seg.rows = 24;
  for (const int k : slices) {
    const int left = 5 + k / 2 + k % 3, top = 6 - k % 4;
    SegBytes::Frame frame{1, 0, {}, scan.world(left, top, k)};
    for (int row = 0; row < seg.rows; ++row)
      for (int column = 0; column < seg.columns; ++column)
        frame.values.push_back(in_organ(left + column, top + row, k));
    seg.frames.push_back(frame);
  }
  return seg;
}

TEST_F(MaskPlanes, SegmentationsLieOnTheirScan) {
  for (const Scan& scan : scans()) {
    const Volume ct = ct_of(scan);
    for (const auto& [name, slices] : selections()) {
      SCOPED_TRACE(scan.name + ", " + name);
      const Volume mask = read(seg_of(scan, slices).bytes(), &ct);
      expect_like(mask, counted(scan, slices));
      EXPECT_THAT(mask.warnings, IsEmpty());
      std::vector<int> inside = slices;  // the cropped frames hold the organ in the middle slices
      std::erase_if(inside, [](int k) { return k < 3 || k > 14; });
      if (inside.empty()) continue;
      SCOPED_TRACE("cropped");
      expect_like(read(cropped_seg_of(scan, inside).bytes(), &ct), counted(scan, inside));
    }
  }
}

// The places of the frames suffice where none is left out.
TEST_F(MaskPlanes, SegmentationsOfEvenScansNeedNoScan) {
  for (const Scan& scan : scans()) {
    if (scan.name == "uneven") continue;
    SCOPED_TRACE(scan.name);
    const std::vector<int>& all = selections().front().second;
    expect_like(read(seg_of(scan, all).bytes(), nullptr), counted(scan, all));
    SegBytes sparse = seg_of(scan, {5, 7, 10, 13});
    sparse.gap = to_text(scan.along[1]);
    expect_like(read(sparse.bytes(), nullptr), counted(scan, {5, 7, 10, 13}));
    SegBytes far = seg_of(scan, {1, 18});
    far.thickness = sparse.gap;
    expect_like(read(far.bytes(), nullptr), counted(scan, {1, 18}));
  }
}

std::vector<Eigen::Vector2d> outline(const Scan& scan, int k) {
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 180; ++i) {
    const double angle = M_PI * i / 90, radius = std::sqrt(64.0 + 4 * (k % 5));
    const Eigen::Vector3d at = scan.world(18 + 0.3 * k + radius * std::cos(angle),
                                          17 - 0.2 * k + radius * std::sin(angle), k);
    points.push_back((scan.axes.transpose() * at).head<2>());
  }
  return points;
}

TEST_F(MaskPlanes, ContoursLieOnTheirScan) {
  for (const Scan& scan : scans()) {
    const Volume ct = ct_of(scan);
    for (const auto& [name, slices] : selections()) {
      SCOPED_TRACE(scan.name + ", " + name);
      Roi roi{"organ", {}};
      Truth truth;
      for (const int k : slices) {
        roi.contours.push_back({scan.corner(k).dot(scan.axes.col(2)), outline(scan, k)});
        // One plane that is missing is filled from both sides.
        const auto is_in = [&](int other) {
          return std::find(slices.begin(), slices.end(), other) != slices.end();
        };
        double low = scan.low(k), high = scan.high(k);
        const auto at = [&](int other) { return scan.along[std::size_t(other)]; };
        if (!is_in(k - 1) && is_in(k - 2)) low = (at(k - 2) + at(k)) / 2;
        if (!is_in(k + 1) && is_in(k + 2)) high = (at(k) + at(k + 2)) / 2;
        // Of 180 points: the polygon's area.
        const double area = 0.8 * 0.7 * (64 + 4 * (k % 5)) * 90 * std::sin(2 * M_PI / 180);
        truth.ml += area * (high - low) / 1000;
        truth.centre_mm += area * (high - low) / 1000 *
                           (scan.world(18 + 0.3 * k, 17 - 0.2 * k, k) +
                            ((high + low) / 2 - at(k)) * scan.axes.col(2));
      }
      truth.centre_mm /= truth.ml;
      expect_like(read(structure_set({roi}, scan.axes), &ct, "organ"), truth);
    }
  }
}

// Programs lead contours through the centres of the outermost voxels, which belong to the organ.
TEST_F(MaskPlanes, ContoursRoundVoxelsGiveTheseBackOnAnyScan) {
  for (const Scan& scan : scans()) {
    const Volume ct = ct_of(scan);
    for (const auto& [name, slices] : selections()) {
      if (name == "every second" || name == "sparse") continue;  // filled in between
      SCOPED_TRACE(scan.name + ", " + name);
      Roi roi{"organ", {}};
      Truth truth;
      for (const int k : slices) {
        const int left = 5 + k, right = left + 9, top = 20 - k, bottom = top + 7;
        std::vector<Eigen::Vector2d> points;
        for (const auto& [column, row] :
             {std::pair{left, top}, {right, top}, {right, bottom}, {left, bottom}})
          points.push_back((scan.axes.transpose() * scan.world(column, row, k)).head<2>());
        roi.contours.push_back({scan.corner(k).dot(scan.axes.col(2)), points});
        const double ml = 10 * 8 * 0.8 * 0.7 * (scan.high(k) - scan.low(k)) / 1000;
        const double middle = (scan.high(k) + scan.low(k)) / 2 - scan.along[std::size_t(k)];
        truth.ml += ml;
        truth.centre_mm += ml * (scan.world((left + right) / 2.0, (top + bottom) / 2.0, k) +
                                 middle * scan.axes.col(2));
      }
      truth.centre_mm /= truth.ml;
      expect_like(read(structure_set({roi}, scan.axes), &ct, "organ"), truth);
    }
  }
}

TEST_F(MaskPlanes, NiftiMasksOfSkewGridsKeepTheirPlanes) {
  file_ = folder_.path() / "mask.nii";
  for (const Scan& scan : scans()) {
    if (scan.name == "uneven") continue;  // no NIfTI is
    for (const auto& [name, slices] : selections()) {
      SCOPED_TRACE(scan.name + ", " + name);
      Volume stored;
      stored.size = {Scan::kColumns, Scan::kRows, static_cast<int>(scan.along.size())};
      stored.spacing_mm = {0.8, 0.7, scan.along[1]};
      stored.direction = scan.axes;
      stored.origin_mm = scan.corner(0);
      for (int k = 0; k < stored.size[2]; ++k) {
        const bool there = std::find(slices.begin(), slices.end(), k) != slices.end();
        for (int row = 0; row < Scan::kRows; ++row)
          for (int column = 0; column < Scan::kColumns; ++column)
            stored.voxels.push_back(there && in_organ(column, row, k));
      }
      NiftiBytes nifti(stored);
      const Eigen::Vector3d step = scan.corner(1) - scan.corner(0);
      nifti.pixdim[3] = static_cast<float>(step.norm());
      for (int row = 0; row < 3; ++row)
        nifti.sform[4 * row + 2] = static_cast<float>((row < 2 ? -1 : 1) * step[row]);
      const Truth found = measured(read(nifti.bytes(), nullptr, "1"));
      const Truth truth = counted(scan, slices);
      EXPECT_NEAR(found.ml / truth.ml, 1, kVolumeShare);
      // Each plane moves to the nearest pixels of one lattice: half a pixel at most.
      EXPECT_LT((found.centre_mm - truth.centre_mm).norm(),
                kCentre_mm + (scan.drift.norm() > 0 ? 0.35 : 0));
    }
  }
}

TEST_F(MaskPlanes, WhatAFileTellsOfItsGapIsHeldAgainstItsPlanes) {
  const Scan scan = scans().front();
  const std::vector<int>& all = selections().front().second;
  SegBytes wrong = seg_of(scan, all);
  wrong.gap = "1";
  for (const bool with_scan : {true, false}) {
    const Volume ct = ct_of(scan);
    const Volume mask = read(wrong.bytes(), with_scan ? &ct : nullptr);
    expect_like(mask, counted(scan, all));
    if (with_scan) continue;
    EXPECT_THAT(mask.warnings, Contains(HasSubstr("though it tells 1.00 mm")));
  }
  // One of two planes may be left out, two of three are not.
  SegBytes second = seg_of(scan, {4, 6, 8, 10, 12, 14});
  second.gap = "3";
  const Volume stripes = read(second.bytes(), nullptr);
  expect_like(stripes, counted(scan, {4, 6, 8, 10, 12, 14}));
  EXPECT_THAT(stripes.warnings, Contains(HasSubstr("each was taken for 3.00 mm thick")));
  SegBytes alone = seg_of(scan, {9});
  EXPECT_THAT(read(alone.bytes(), nullptr).warnings, Contains(HasSubstr("1 mm was assumed")));
  alone.gap = "1e30";  // no gap of any scan
  EXPECT_THAT(read(alone.bytes(), nullptr).warnings, Contains(HasSubstr("1 mm was assumed")));
  alone.gap.clear();
  // From head to foot, in thin slices.
  SegBytes body = seg_of(scan, {1, 18});
  body.thickness = "0.6";
  body.frames[0].corner->z() += 1200;
  EXPECT_NEAR(measured(read(body.bytes(), nullptr)).ml / counted(scan, {1, 18}).ml, 0.2,
              0.2 * kVolumeShare);
  alone.thickness = "3";
  const Volume thick = read(alone.bytes(), nullptr);
  expect_like(thick, counted(scan, {9}));
  EXPECT_THAT(thick.warnings, IsEmpty());
  // A segmentation of thicker slices on a finer scan keeps its own.
  Scan fine = scan;
  fine.along = evenly(1, 60);
  const Volume fine_ct = ct_of(fine);
  SegBytes thicker = seg_of(scan, all);
  thicker.gap = "3";
  expect_like(read(thicker.bytes(), &fine_ct), counted(scan, all));
}

TEST_F(MaskPlanes, ASegmentationTurnedAgainstItsScanKeepsItsOwnPlanes) {
  const Volume ct = ct_of(scans().front());
  const Scan turned = scans()[1];
  for (const auto& [name, slices] : selections()) {
    SCOPED_TRACE(name);
    SegBytes seg = seg_of(turned, slices);
    seg.gap = seg.thickness = "2.5";
    if (name != "every second") expect_like(read(seg.bytes(), &ct), counted(turned, slices));
  }
}

TEST_F(MaskPlanes, LesionsFarApartAreAsThickAsTheScansSlices) {
  const Scan scan = scans().front();
  const Volume ct = ct_of(scan);
  Roi lesions{"lesions", {}}, third{"every third", {}};
  for (const int k : {1, 18}) lesions.contours.push_back({scan.corner(k).z(), outline(scan, 0)});
  const double slice_ml = 0.8 * 0.7 * M_PI * 64 * 3 / 1000;
  const auto ml = [&](const std::vector<Roi>& regions, const Volume* on, const std::string& name) {
    return label_figures(read(structure_set(regions), on, name)).front().volume_ml;
  };
  EXPECT_NEAR(ml({lesions}, &ct, "lesions") / (2 * slice_ml), 1, kVolumeShare);
  Roi alone = lesions;
  alone.contours.pop_back();
  EXPECT_NEAR(ml({alone}, &ct, "lesions") / slice_ml, 1, kVolumeShare);
  // Without a scan another region of the file shows the gap, or the contours' own thickness.
  Roi body{"body", {}};
  for (int k = 0; k < 20; ++k) body.contours.push_back({scan.corner(k).z(), outline(scan, 0)});
  EXPECT_NEAR(ml({lesions, body}, nullptr, "lesions") / (2 * slice_ml), 1, kVolumeShare);
  alone.slab = "3";
  EXPECT_NEAR(ml({alone}, nullptr, "lesions") / slice_ml, 1, kVolumeShare);
  alone.slab.clear();
  EXPECT_THAT(read(structure_set({alone}), nullptr, "lesions").warnings,
              Contains(HasSubstr("lesions: how thick its planes are is told nowhere")));
  // Contours on every third slice are an organ, not stripes.
  Scan fine = scan;
  fine.along = evenly(1, 60);
  const Volume fine_ct = ct_of(fine);
  for (int k = 3; k < 15; ++k) third.contours.push_back({scan.corner(k).z(), outline(scan, 0)});
  EXPECT_NEAR(ml({third}, &fine_ct, "every third") / (12 * slice_ml), 1, kVolumeShare);
}

TEST_F(MaskPlanes, OneOfSeveralPhasesIsAskedFor) {
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

TEST_F(MaskPlanes, TwoHalvesOfASegmentInOnePlaneAreUnited) {
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

TEST_F(MaskPlanes, WhatNoGridHoldsIsRefusedByName) {
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

TEST_F(MaskPlanes, AnotherFrameOfReferenceIsSaid) {
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

}  // namespace
}  // namespace organbake
