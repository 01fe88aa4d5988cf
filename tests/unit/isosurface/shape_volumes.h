// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/volume/volume.h"
#include "support/testing.h"

namespace organbake {

// Signed distance-like function of world millimetres, positive inside.
using Shape = std::function<double(const Eigen::Vector3d&)>;

Shape ball(const Eigen::Vector3d& center, double radius_mm);
// Three balls of different sizes along the three axes, joined: no mirroring maps it onto itself.
Shape asymmetric_organ();

// An empty grid of about extent_mm round the origin; its middle voxel is a little off the origin.
Volume grid_around_origin(const Eigen::Vector3d& spacing_mm, double extent_mm,
                          const Eigen::Matrix3d& direction = Eigen::Matrix3d::Identity());
Eigen::Matrix3d oblique_direction();
// Every way a scan's axes can lie: upright, oblique, and both with one axis reversed.
std::vector<Eigen::Matrix3d> all_directions();

// A CT of tissue at 100 HU in air at −1000, the edge 200 HU/mm wide (±2.75 mm): no partial volume
// effect beyond rounding, so that the surface at −450 HU is the shape's zero to rounding.
Volume scan_of(const Shape& shape, Volume grid);
inline constexpr double kScanIso_hu = -450;
// A mask: 1 where the shape is.
Volume mask_of(const Shape& shape, Volume grid, int label = 1);

Eigen::Vector3d centroid(const TriangleMesh& mesh);  // of the enclosed volume
double sphere_volume(double radius_mm);
// RMS of |v| − radius over the vertices.
double radius_rms(const TriangleMesh& mesh, double radius_mm);
// Area-weighted RMS angle between face normals and the radial direction, degrees.
double radial_normal_rms_deg(const TriangleMesh& mesh);

void expect_closed_and_sound(const TriangleMesh& mesh);

}  // namespace organbake
