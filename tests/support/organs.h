// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>

#include "organbake/bundle/bundle.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/cutting/cut_body.h"
#include "organbake/cutting/cut_sheet.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// An organ of known formula: a lumpy ellipsoid whose maps, base layer and truth mesh follow from
// the formula, so that what a bundle holds is exact whatever the baker does.
struct SyntheticOrgan {
  Eigen::Vector3d center = {10, -20, 30};
  Eigen::Vector3d half_axes_mm = {60, 45, 50};
  double lump_share = 0;      // amplitude of the lumps as a share of the radius; 0 = ellipsoid
  double lump_frequency = 5;  // per radian, about
  double texture_mm = 6;      // shortest wavelength of the texture: features of half that size
  bool mirrored = false;      // everything reflected in the plane x = center.x

  // Distance from the centre along a unit direction.
  double radius(const Eigen::Vector3d& direction) const;
  // Linear colour of a surface point.
  Eigen::Vector3f color(const Eigen::Vector3d& point) const;
  // Planar depth t of the first hit of origin + t·ray, or +inf.
  double trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const;
  TriangleMesh mesh(int subdivisions) const;  // with colours
};

struct SyntheticOptions {
  SyntheticOrgan organ;
  int camera_count = 6;  // 6 (axes), 8 (corners of a cube) or 14 (both)
  int map_size = 128;
  int proxy_subdivisions = 1;  // 20·4ⁿ faces
  int rays_per_texel_side = 1;
  double base_step_mm = 3;
};

CameraSet make_cameras(const SyntheticOptions& options);
Bundle make_synthetic_bundle(const SyntheticOptions& options);

// A lumpy organ with 6 cameras of 128² and an 80-face proxy, made once.
const SyntheticOptions& organ_options();
const Bundle& organ_to_play();

// The organ moved by a smooth dent of a given depth at the proxy vertex that lies farthest along
// `direction`: new positions of the proxy's vertices. Vertices farther from it than 0.3 of the
// proxy's diagonal stay exactly where they are.
std::vector<Eigen::Vector3d> dented(const TriangleMesh& proxy, const Eigen::Vector3d& direction,
                                    double depth_mm);

// A whole, valid bundle of two 8×6 cameras round a tetrahedron.
Bundle small_bundle();
// Two tetrahedra that carry a vertex at a corner and others within, for its mechanics.
TetrahedralBody small_body();
void write_bundle(const std::filesystem::path& folder, const Bundle& bundle);

}  // namespace organbake

namespace organbake::test {

// Cubes from the origin on, five tetrahedra each.
TetrahedralBody block(const Eigen::Array3i& count, double cell_mm);
// Tetrahedra that fill a closed skin and stand out of it, its vertices embedded. The nodes whose y
// is the least are anchors.
TetrahedralBody tissue_under(const TriangleMesh& skin, double cell_mm);

// A stroke along a polyline of the blade's tip, its edge `up` long.
void add_stroke(const std::vector<Eigen::Vector3d>& tips, const Eigen::Vector3d& up,
                CutSheet& sheet);

EdgeCrossings crossings(const TetrahedralBody& body, const MaterialGrid& grid);
double volume_mm3(const TetrahedralBody& body);
// mm³ by fragment, of whole tetrahedra (their fill is not asked for).
std::vector<double> fragment_volumes(const CutTetrahedra& cut, const TetrahedralBody& body);
// Whether every edge is used as often one way as the other.
bool is_closed(const TriangleMesh& mesh);

}  // namespace organbake::test
