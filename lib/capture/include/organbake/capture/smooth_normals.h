// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// A surface's normals and points at ray hits. Keeps a reference to the mesh.
class SmoothNormals {
 public:
  explicit SmoothNormals(const TriangleMesh& mesh);

  // Unit; interpolated from the vertices, so that shading does not show the faces.
  Eigen::Vector3d at(const RayHit& hit) const;
  // Whether the face itself, not its smooth normal, looks against the direction. False for a face
  // without area.
  bool faces_against(std::uint32_t face, const Eigen::Vector3d& direction) const {
    return face_normals_[face].dot(direction) < 0;
  }
  Eigen::Vector3d point(const RayHit& hit) const;
  // Whether a ray crosses the very face, and if so its hit.
  bool crosses(std::uint32_t face, const Ray& ray, RayHit& hit) const;
  // The hit that a ray would have had at a point of the face (t stays infinite).
  RayHit hit_at(std::uint32_t face, const Eigen::Vector3d& point) const;

 private:
  const TriangleMesh& mesh_;
  std::vector<Eigen::Vector3d> vertex_normals_;
  std::vector<Eigen::Vector3d> face_normals_;
};

}  // namespace organbake
