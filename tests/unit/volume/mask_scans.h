// SPDX-License-Identifier: GPL-3.0-or-later
// Scans whose planes lie straight, tilted, oblique or unevenly, and an organ in them whose volume
// and middle are known.
#pragma once

#include "support/testing.h"
#include "volume_fixtures.h"

namespace organbake {

// The issue's: half a voxel's share is what rounding a plane to whole pixels costs at most.
inline constexpr double kCentre_mm = 0.1, kVolumeShare = 0.005;

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

inline std::vector<double> evenly(double gap, int count = 20) {
  std::vector<double> along;
  for (int k = 0; k < count; ++k) along.push_back(gap * k);
  return along;
}

inline std::vector<Scan> scans() {
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
inline bool in_organ(double column, double row, int k) {
  const double x = column - 18 - 0.3 * k, y = row - 17 + 0.2 * k;
  return x * x + y * y <= 64 + 4 * (k % 5);
}

struct Truth {
  double ml = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();

  void add(double more_ml, const Eigen::Vector3d& centre_mm) {
    ml += more_ml, moment += more_ml * centre_mm;
  }
  Eigen::Vector3d centre_mm() const { return moment / ml; }
};

// By counting voxels.
inline Truth counted(const Scan& scan, const std::vector<int>& slices) {
  Truth truth;
  for (const int k : slices) {
    const double voxel = 0.8 * 0.7 * (scan.high(k) - scan.low(k));
    const double middle = (scan.high(k) + scan.low(k)) / 2 - scan.along[std::size_t(k)];
    for (int row = 0; row < Scan::kRows; ++row) {
      for (int column = 0; column < Scan::kColumns; ++column) {
        if (!in_organ(column, row, k)) continue;
        truth.add(voxel / 1000, scan.world(column, row, k) + middle * scan.axes.col(2));
      }
    }
  }
  return truth;
}

inline Truth measured(const Volume& mask) {
  Truth found;
  const double voxel = mask.spacing_mm.prod() / 1000;
  for_each_voxel(mask.size, [&](int i, int j, int k) {
    if (mask.at(i, j, k) == 0) return;
    found.add(voxel, mask.world_from_index({double(i), double(j), double(k)}));
  });
  return found;
}

inline void expect_like(const Volume& mask, const Truth& truth) {
  const Truth found = measured(mask);
  EXPECT_NEAR(found.ml / truth.ml, 1, kVolumeShare);
  EXPECT_LT((found.centre_mm() - truth.centre_mm()).norm(), kCentre_mm)
      << found.centre_mm().transpose() << " for " << truth.centre_mm().transpose();
}

class MaskPlanes : public ::testing::Test {
 protected:
  Volume ct_of(const Scan& scan, const std::string& frame_of_reference = {}) {
    const std::filesystem::path folder = folder_.path() / "ct";
    std::filesystem::remove_all(folder);
    std::filesystem::create_directory(folder);
    for (int k = 0; k < static_cast<int>(scan.along.size()); ++k) {
      DicomBytes slice;
      slice.set_position(scan.corner(k));
      slice.orientation = orientation_text(scan.axes);
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
  std::filesystem::path file_ = folder_.path() / "mask.dcm";
};

inline SegBytes empty_seg(const Scan& scan) {
  SegBytes seg;
  seg.columns = Scan::kColumns;
  seg.rows = Scan::kRows;
  seg.orientation = orientation_text(scan.axes);
  seg.pixel_spacing = "0.7\\0.8";
  return seg;
}

inline SegBytes seg_of(const Scan& scan, const std::vector<int>& slices) {
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

inline std::vector<Eigen::Vector2d> outline(const Scan& scan, int k) {
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 180; ++i) {
    const double angle = M_PI * i / 90, radius = std::sqrt(64.0 + 4 * (k % 5));
    const Eigen::Vector3d at = scan.world(18 + 0.3 * k + radius * std::cos(angle),
                                          17 - 0.2 * k + radius * std::sin(angle), k);
    points.push_back((scan.axes.transpose() * at).head<2>());
  }
  return points;
}

}  // namespace organbake
