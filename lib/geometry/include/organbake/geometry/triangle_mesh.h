// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace organbake {

using Face = std::array<std::uint32_t, 3>;
inline bool has_corner(const Face& face, std::uint32_t vertex) {
  return face[0] == vertex || face[1] == vertex || face[2] == vertex;
}

// Triangles with counter-clockwise corners seen from outside. World millimetres (LPS).
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Face> faces;
  // Per-vertex scene-linear RGB in 0…1 (Lambertian radiance); empty or one per vertex.
  std::vector<Eigen::Vector3f> colors;

  bool empty() const { return faces.empty(); }
};

struct Bounds {
  Eigen::Vector3d min = Eigen::Vector3d::Constant(1e300);
  Eigen::Vector3d max = Eigen::Vector3d::Constant(-1e300);
  Eigen::Vector3d center() const { return 0.5 * (min + max); }
  double diagonal() const { return (max - min).norm(); }
  void add(const Eigen::Vector3d& point) { min = min.cwiseMin(point), max = max.cwiseMax(point); }
  bool meets(const Bounds& other) const {
    return (min.array() <= other.max.array()).all() && (other.min.array() <= max.array()).all();
  }
};

Bounds bounds(const TriangleMesh& mesh);
Eigen::Vector3d face_normal(const TriangleMesh& mesh,
                            std::size_t face);  // unit; zero if degenerate
// By corner, the face's unit normal times its angle there (rad).
std::array<Eigen::Vector3d, 3> corner_normals(const TriangleMesh& mesh, std::size_t face);
double face_area(const TriangleMesh& mesh, std::size_t face);  // mm²
double signed_volume(const TriangleMesh& mesh);  // mm³; positive when faces look outward
double surface_area(const TriangleMesh& mesh);   // mm²
// mm; an edge counts for each of its faces. 0 without faces.
double mean_edge_length(const TriangleMesh& mesh);
// Unit vertex normals, faces weighted by their angle at the vertex (Thürmer & Wüthrich 1998);
// a vertex without a face of area gets +z.
std::vector<Eigen::Vector3d> vertex_normals(const TriangleMesh& mesh);

}  // namespace organbake
