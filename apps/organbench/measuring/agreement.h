// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

// What suites and trials hold results against.

namespace organbake {

// Mean relative error of a range, one scale fitted; both are logarithms of ranges.
double range_error_percent(const Plane& log_range, const Plane& truth);

// Seen through the middle of a texel, counted row by row, at a planar depth.
Eigen::Vector3d texel_point(const PosedCamera& camera, std::size_t texel, double depth_mm);

// Depths that were found, beside the true ones of the same pixels, of as many frames as one scale
// is to hold for. Depths are planar; +inf and 0 = none.
struct DepthPairs {
  std::vector<float> found, truth;
  std::size_t asked = 0;  // pixels that have a true depth

  void add(float found_depth, float true_depth);
  // Two maps of one view, of sizes in proportion: the pixels of the one that was found.
  void add_maps(const Plane& found_depth, const Plane& true_depth);
};

struct DepthAgreement {
  double scale = 1;         // true by found, median
  double mean_percent = 0;  // relative difference after this one scale
  double median_percent = 0;
  double spearman = 0;         // rank correlation
  double covered_percent = 0;  // of what was asked
};

// Of at least one pair; throws std::invalid_argument else.
DepthAgreement agreement_of(const DepthPairs& pairs);

// The rank correlation of two sequences of one length; equal values share their mean rank.
double spearman(const std::vector<float>& a, const std::vector<float>& b);

// Between the four pixels round a place; +inf where one of them has no depth or it is outside.
float depth_between(const Plane& depth, const Eigen::Vector2d& pixel);

// Points of a cloud as a camera sees them.
struct SeenPoint {
  Eigen::Vector2d pixel;
  float depth;
};
// Those in the picture, without the ones behind a nearer one in the same square of `cell_px`.
std::vector<SeenPoint> nearest_points(const PosedCamera& camera,
                                      const std::vector<Eigen::Vector3d>& cloud, int cell_px);

// The number that a frame's name ends with, its ending aside: 12 of frame_000012.png.
std::optional<int> frame_of_name(const std::string& name);

// A reconstruction's cameras against the true ones, both called by their frames, after the
// similarity that brings their centres nearest in the least-squares sense (Umeyama 1991).
struct PathError {
  std::size_t frames = 0;  // that both have
  double rms_percent = 0;  // of the centres, by the largest distance between two true ones
  double scale = 1;        // true by found
};

// Nothing when fewer than three frames are in both.
std::optional<PathError> path_error(const CameraSet& found, const CameraSet& truth);

}  // namespace organbake
