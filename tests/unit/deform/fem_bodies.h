// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/bundle/mechanics_model.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake::test {

struct FemOptions {
  double young_modulus_kpa = 10;
  double poisson_ratio = 0.45;
  double damping_s = 0;
  double anchored_below = -0.6;  // vertices with z < this share of the radius are held
};

// A star-shaped mesh round its centre, filled with two layers of tetrahedra; its vertices are
// nodes.
MechanicsModel fem_ball(const TriangleMesh& mesh, const FemOptions& options = {});

// A bar along x of whole cubes, six tetrahedra each; all its nodes are the proxy's vertices, those
// at x = 0 are held.
struct FemBar {
  Eigen::Vector3i cubes = {6, 2, 2};
  double cube_mm = 10;
  TriangleMesh mesh;
  MechanicsModel mechanics;

  explicit FemBar(const FemOptions& options = {});
  Eigen::Vector3d size_mm() const { return cube_mm * cubes.cast<double>(); }
  // Of each vertex at the far end: its third of the faces there, mm²; 0 elsewhere.
  std::vector<double> end_areas() const;
};

}  // namespace organbake::test
