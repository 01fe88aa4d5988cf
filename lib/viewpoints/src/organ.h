// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

// How cameras frame an organ: all look at the centre of its bounds and hold it whole.
class OrganFrame {
 public:
  // Of the vertices that faces use. Throws BadDataError for a surface without (finite) extent.
  explicit OrganFrame(const TriangleMesh& surface);

  const Eigen::Vector3d& center_mm() const { return center_; }

  // The least common distance of cameras in these directions at which every vertex lies inside
  // every map.
  double common_distance_mm(const std::vector<Eigen::Vector3d>& directions,
                            const PlacementOptions& options, const RunContext& context) const;

  // The camera in a direction, its focal length raised until the organ fills its map; unnamed.
  PosedCamera camera(const Eigen::Vector3d& direction, double distance_mm,
                     const PlacementOptions& options) const;

 private:
  Eigen::Vector3d center_;
  std::vector<Eigen::Vector3d> points_;  // about the centre
  double radius_ = 0;
};

// `count` unit directions spread evenly over the cap within `half_angle_rad` (0…π) of an axis,
// the first on the axis (unless two or three share a cap of less than a quarter turn: those all
// stand on its rim). They start on a Fibonacci spiral and repel each other with the energy Σ 1/r²
// until they rest (Thomson's problem, with the cap's rim as a wall): four all round make a
// tetrahedron, six an octahedron, eight a square antiprism. Rolled about the axis so that the
// first one's nearest neighbour lies beside it, level with the world's z. Always the same.
std::vector<Eigen::Vector3d> spread_directions(int count, const Eigen::Vector3d& axis,
                                               double half_angle_rad);

// About how far apart neighbours are when `count` share the cap evenly.
double even_spacing_rad(std::size_t count, double half_angle_rad);

// Many unit directions over the same cap at once, on a Fibonacci spiral: even, not at rest. Those
// `on_rim` begin on the axis and end with a ring along the cap's rim (more than `count` in all);
// the others keep half a step off both, so that the two share no direction.
enum class LatticeKind { on_rim, off_rim };
std::vector<Eigen::Vector3d> lattice_directions(int count, const Eigen::Vector3d& axis,
                                                double half_angle_rad, LatticeKind lattice);

// The polyhedron { x : directions_i · x ≤ 1 } ∩ [−box, box]³.
struct PlanePolyhedron {
  struct Vertex {
    Eigen::Vector3d position;
    std::vector<std::uint32_t> planes;  // of the directions through it, increasing
    bool on_box = false;
  };
  std::vector<Vertex> vertices;
  TriangleMesh surface;  // outward, facets fanned
};

// Exact in what meets where (CGAL); vertices in the order of their places. The box is a power of
// two above 1: its inverse is then exact, too.
PlanePolyhedron intersect_view_planes(const std::vector<Eigen::Vector3d>& directions, double box);

// The cameras of given unit directions and distance, with their VPM.
Placement placement_of(const OrganFrame& organ, const std::vector<Eigen::Vector3d>& directions,
                       double distance_mm, const PlacementOptions& options);

// The VPM of given directions at one common distance; bounded by a box when the cameras do not
// surround the centre; vertices of more than three planes are fanned from their lowest camera.
// Fills placement.manifold and placement.manifold_surface. Triangles run counter-clockwise seen
// from outside, start at their lowest camera and are sorted; there are none for fewer than three
// cameras or for cameras that all lie in one plane with the centre. Throws BadDataError when an
// eye is at the centre, not finite, or in the same direction as another.
void build_view_manifold(const Eigen::Vector3d& center, const std::vector<Eigen::Vector3d>& eyes,
                         Placement& placement);

}  // namespace organbake
