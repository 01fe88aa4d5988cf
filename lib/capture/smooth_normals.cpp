// SPDX-License-Identifier: GPL-3.0-or-later
#include "capture/smooth_normals.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "raycast/face_queries.h"

namespace organbake {

SmoothNormals::SmoothNormals(const TriangleMesh& mesh)
    : mesh_(mesh), vertex_normals_(vertex_normals(mesh)), face_normals_(mesh.faces.size()) {
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) face_normals_[f] = face_normal(mesh, f);
}

Eigen::Vector3d SmoothNormals::at(const RayHit& hit) const {
  const Face& face = mesh_.faces[hit.face];
  const double u = hit.u, v = hit.v;
  const Eigen::Vector3d sum = (1 - u - v) * vertex_normals_[face[0]] +
                              u * vertex_normals_[face[1]] + v * vertex_normals_[face[2]];
  // Opposite vertex normals can cancel on a sliver or a thin sheet.
  constexpr double kCancelled = 1e-6;
  const double length = sum.norm();
  return length > kCancelled ? Eigen::Vector3d(sum / length) : face_normals_[hit.face];
}

Eigen::Vector3d SmoothNormals::point(const RayHit& hit) const {
  const Face& face = mesh_.faces[hit.face];
  const double u = hit.u, v = hit.v;
  return (1 - u - v) * mesh_.vertices[face[0]] + u * mesh_.vertices[face[1]] +
         v * mesh_.vertices[face[2]];
}

bool SmoothNormals::crosses(std::uint32_t face, const Ray& ray, RayHit& hit) const {
  const auto& [a, b, c] = mesh_.faces[face];
  const PlaneCrossing crossing = cross_plane(
      {mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]}, ray.origin, ray.direction);
  if (!crossing.inside_by(0) || !(crossing.t > 0)) return false;
  hit = {face, crossing.t, static_cast<float>(crossing.u), static_cast<float>(crossing.v)};
  return true;
}

RayHit SmoothNormals::hit_at(std::uint32_t face, const Eigen::Vector3d& point) const {
  const auto& [a, b, c] = mesh_.faces[face];
  const Eigen::Vector3d& origin = mesh_.vertices[a];
  const Eigen::Vector3d e1 = mesh_.vertices[b] - origin, e2 = mesh_.vertices[c] - origin;
  const Eigen::Vector3d to_point = point - origin, normal = e1.cross(e2);
  RayHit hit;
  hit.face = face;
  const double area2 = normal.squaredNorm();
  if (!(area2 > 0)) return hit;
  hit.u = static_cast<float>(std::clamp(to_point.cross(e2).dot(normal) / area2, 0.0, 1.0));
  hit.v = static_cast<float>(std::clamp(e1.cross(to_point).dot(normal) / area2, 0.0, 1.0));
  return hit;
}

}  // namespace organbake
