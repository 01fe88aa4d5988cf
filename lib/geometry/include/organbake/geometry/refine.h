// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes made: spheres of triangles, edges halved until they are short enough, points spread
// evenly; and the place of a triangle that is nearest to a point.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The unit icosahedron with every face cut in four `subdivisions` times (0…9): 20 · 4^n outward
// faces, vertices on the unit sphere. Vertices of level n come first in level n + 1.
TriangleMesh make_icosphere(int subdivisions);

// A place on a mesh: weights u, v of the face's corners 1 and 2, the rest of corner 0.
struct SurfacePlace {
  std::uint32_t face = 0;
  float u = 0, v = 0;
};

struct RefinedMesh {
  TriangleMesh mesh;                 // the coarse vertices first, as they were; no colours
  std::vector<SurfacePlace> places;  // of each vertex, on the coarse mesh
};

// Halves edges longer than longest_mm until none is left: the same surface, so that what is kept
// per vertex (colour) gets as fine as wanted. Neighbours stay joined. Vertices without a face keep
// place 0. Throws UsageError unless longest_mm is positive, or when the result would pass
// most_faces.
RefinedMesh refine_edges(const TriangleMesh& coarse, double longest_mm,
                         std::size_t most_faces = 50'000'000);

// Barycentric weights of the point of triangle abc nearest to p (Ericson, Real-Time Collision
// Detection, 5.1.5). A triangle that is an edge or a point gives the nearest of what it is.
Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

// Points spread evenly by area over a mesh: point i lies in the i-th of equal slices of the area
// (stratification), at random in its face; one random stream a point. Keeps a reference to the
// mesh. Throws BadDataError when the mesh has no (finite) area.
class AreaSampler {
 public:
  AreaSampler(const TriangleMesh& mesh, std::size_t samples, std::uint64_t seed);
  struct Sample {
    std::uint32_t face;
    Eigen::Vector3d weights;  // of the face's corners, sum 1
    Eigen::Vector3d point;    // mm
  };
  Sample at(std::size_t i) const;
  Eigen::Vector3d operator()(std::size_t i) const { return at(i).point; }
  double area_mm2() const { return cumulative_.back(); }

 private:
  const TriangleMesh& mesh_;
  std::vector<double> cumulative_;
  std::size_t samples_;
  std::uint64_t seed_;
};

}  // namespace organbake
