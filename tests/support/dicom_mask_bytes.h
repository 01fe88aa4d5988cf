// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

namespace organbake {

// A segmentation of "liver" and "cyst, large" as a DICOM file. Frames of 7×5 pixels, so that a
// frame's 35 bits end in the middle of a byte.
struct SegBytes {
  struct Frame {
    int segment;
    double z;
    std::vector<int> values;  // 35
  };
  std::string kind = "BINARY";
  int bits = 1;
  std::vector<Frame> frames;
  bool rle = false;

  std::string bytes() const;

  // Each frame's bytes as one segment (PS3.5, G): a run of zeros, then literals.
  std::string run_lengths() const;
};

// One region of interest of closed contours, each x, y of a plane.
struct Roi {
  std::string name;
  std::vector<std::pair<double, std::vector<Eigen::Vector2d>>> contours;
};

// An RTSTRUCT of them.
std::string structure_set(const std::vector<Roi>& regions,
                          const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity());

}  // namespace organbake
