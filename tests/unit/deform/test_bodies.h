// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/instruments/instrument.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake::test {

// An icosahedron whose edges are cut into `frequency` pieces, on a sphere: 10 f² + 2 vertices
// (2 → 42, 7 → 492, 22 → 4842), closed, outward.
TriangleMesh geodesic_sphere(int frequency, double radius_mm);

// The same with seeded bumps of a few wavelengths: a lumpy organ, still star-shaped.
TriangleMesh lumpy_organ(int frequency, double radius_mm, std::uint64_t seed);

// A tool that is there: a ball, or of a kind.
inline Instrument tool_at(const Eigen::Vector3d& position_mm, const InstrumentKind& kind = Ball{},
                          double radius_mm = 5) {
  return {position_mm, radius_mm, kind, true};
}
inline Instrument grasper_at(const Eigen::Vector3d& position_mm, double radius_mm = 5) {
  return tool_at(position_mm, Grasper{}, radius_mm);
}

// How far the farthest of some vertices lie apart.
double farthest_between(const std::vector<Eigen::Vector3d>& a,
                        const std::vector<Eigen::Vector3d>& b);
// A mesh with its vertices elsewhere.
TriangleMesh posed(TriangleMesh mesh, const std::vector<Eigen::Vector3d>& vertices);

DeformOptions with_fem(double time_step_s = 1.0 / 60);

struct BodyOptions {
  double stiffness_n_per_mm = 0.15;  // about 10 kPa of tissue, 15 mm thick
  double density_kg_per_m3 = 1060;
  double damping_ratio = 0.7;
  double volume_stiffness = 1;
  double anchored_below = -0.6;  // vertices with z < this share of the radius are held
};

// Edges, bending springs across edges, and a strut from every vertex to the one opposite.
MechanicsModel spring_body(const TriangleMesh& mesh, const BodyOptions& options = {});

// A base layer of smooth bumps: the height of the sphere of `radius_mm` over each face.
BaseLayer sphere_base(const TriangleMesh& mesh, double radius_mm, std::uint32_t steps);

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

// A tube bent into a C, its gap to the right: rings of vertices round an arc, closed at the ends,
// held opposite the gap. The last two vertices are the ends' middles, the lower end's last.
struct BentTube {
  TriangleMesh mesh;
  MechanicsModel mechanics;
};
BentTube bent_tube(double gap_rad);

}  // namespace organbake::test
