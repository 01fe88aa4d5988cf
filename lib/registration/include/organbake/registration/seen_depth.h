// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace organbake {

// What is known of the distance of things in a photograph, of the organ and of others: points about
// evenly spread over the view, each the mean of what its neighbourhood shows.
struct SeenDepth {
  struct Point {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // camera axes of the photograph
    // Of what is seen there, towards the camera; zero where too few neighbours tell it.
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double trust = 1;         // 0…1
    int column = 0, row = 0;  // of the neighbourhood in the view's grid
  };
  std::vector<Point> points;
  int columns = 0, rows = 0;
  bool relative = false;  // places are in a unit of their own; else mm

  bool empty() const { return points.empty(); }
};

// Thins points that are seen from the camera's centre, in its axes, to some 1,500 neighbourhoods of
// the view; points that are not before the camera or not finite count as none, and neighbourhoods
// of few points or with a step of depth are left out. `trust` (0…1) has one number a point, or
// none.
SeenDepth thin_depth(const std::vector<Eigen::Vector3d>& points, const std::vector<float>& trust,
                     bool relative);

}  // namespace organbake
