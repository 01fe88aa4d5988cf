// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"

namespace organbake {

// x ↦ scale · rotation · x + translation.
struct SimilarityTransform {
  double scale = 1;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
};

// The one that brings the points nearest to their partners in the least-squares sense (Umeyama
// 1991). At least three points, not all on a line.
SimilarityTransform aligning_similarity(const std::vector<Eigen::Vector3d>& points,
                                        const std::vector<Eigen::Vector3d>& partners);

// The number that a frame's name ends with, its ending aside: 12 of frame_000012.png.
std::optional<int> frame_of_name(const std::string& name);

// A reconstruction's cameras against the true ones, both called by their frames.
struct PathError {
  std::size_t frames = 0;      // that both have
  double extent_mm = 0;        // largest distance between two true centres of these
  double rms_percent = 0;      // distance of the centres after alignment, root mean square
  double largest_percent = 0;  // both by the extent
  double turn_deg = 0;         // between the views' directions and rolls, mean
  SimilarityTransform truth_from_found;
};

// Nothing when fewer than three frames are in both.
std::optional<PathError> path_error(const CameraSet& found, const CameraSet& truth);

// Where the camera was at a frame between two that the set has, by straight lines and even turns.
// Nothing outside them.
std::optional<PosedCamera> camera_at_frame(const CameraSet& set, int frame);

}  // namespace organbake
