// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Two lobes of a liver, a gallbladder as half a cylinder between them and lobules of fat: a height
// field z = h(x, y) in world mm, z away from the scope. A cubic B-spline over a grid, so that
// slopes are smooth; it ends at ±kReachX_mm, ±kReachY_mm.
class TissueRelief {
 public:
  static constexpr double kReachX_mm = 95, kReachY_mm = 62;

  explicit TissueRelief(std::uint64_t seed);

  struct Height {
    double z_mm = 0, slope_x = 0, slope_y = 0;
  };
  // At rest.
  Height at(double x_mm, double y_mm) const;

  // The surface after a breath has pushed it: its height above x, y now, and where the point that
  // is now there lies at rest. The whole tissue is pushed one way, the liver by `excursion_mm`,
  // what lies farther from the diaphragm by less, down to a third.
  struct Breathed {
    Height height;
    double rest_x_mm = 0, rest_y_mm = 0;
  };
  Breathed at(double x_mm, double y_mm, double excursion_mm) const;

  // Shares of liver, gallbladder and fat at x, y at rest, which add up to 1.
  Eigen::Vector3d tissues(double x_mm, double y_mm) const;

  // Vertices `spacing_mm` apart along x and y; faces look at the scope.
  TriangleMesh surface(double spacing_mm, double excursion_mm = 0) const;

 private:
  struct Lobe {
    Eigen::Vector3d center, axes;
    double angle_rad;
  };
  struct Lobule {
    double x, y, radius, height;
  };
  // What each tissue would reach alone, before they are blended.
  struct Heights {
    double liver, gallbladder, fat;
  };
  Heights heights(double x_mm, double y_mm) const;
  double fat_mm(double x_mm, double y_mm) const;
  double blended_mm(double x_mm, double y_mm) const;

  std::uint64_t seed_;
  std::vector<Lobe> lobes_;
  std::vector<Lobule> lobules_;
  Eigen::Vector3d neck_, fundus_;  // of the gallbladder: x, y, radius; mm
  int columns_, rows_;
  std::vector<float> nodes_;  // the spline's coefficients, row by row
};

}  // namespace organbake
