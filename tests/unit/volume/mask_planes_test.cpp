// SPDX-License-Identifier: GPL-3.0-or-later
// Masks lie where their planes lie, and are as thick as these: on straight, tilted, oblique and
// uneven scans, of all frames, of few, of one, and of frames that are cropped each for itself.

#include "mask_scans.h"
#include "organbake/core/text.h"
#include "organbake/volume/read_volume.h"
#include "support/testing.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::vector<std::pair<std::string, std::vector<int>>>& selections() {
  static const std::vector<std::pair<std::string, std::vector<int>>> all = {
      {"all", {3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14}},
      {"every second", {4, 6, 8, 10, 12, 14}},
      {"sparse", {5, 7, 10, 13}},
      {"far apart", {1, 18}},
      {"single", {9}}};
  return all;
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
        truth.add(area * (high - low) / 1000, scan.world(18 + 0.3 * k, 17 - 0.2 * k, k) +
                                                  ((high + low) / 2 - at(k)) * scan.axes.col(2));
      }
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
        truth.add(ml, scan.world((left + right) / 2.0, (top + bottom) / 2.0, k) +
                          middle * scan.axes.col(2));
      }
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
      EXPECT_LT((found.centre_mm() - truth.centre_mm()).norm(),
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

}  // namespace
}  // namespace organbake
