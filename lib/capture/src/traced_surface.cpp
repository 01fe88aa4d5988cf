// SPDX-License-Identifier: GPL-3.0-or-later
// A surface with its rays and its normals. Normals for shading are averaged over as many rounds as
// a CT's slices need, for single vertices of an isosurface tilt by tens of degrees.
#include "organbake/capture/traced_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/raycast/face_queries.h"

namespace organbake {
void check_camera(const PosedCamera& camera) {
  camera.intrinsics.check();
  const RigidTransform& pose = camera.camera_from_world;
  constexpr double kRounding = 1e-6;  // what a pose keeps after a trip through a text file
  const Eigen::Matrix3d product = pose.rotation * pose.rotation.transpose();
  if (!within_reach(pose.translation) ||
      !((product - Eigen::Matrix3d::Identity()).norm() < kRounding) ||
      pose.rotation.row(0).dot(pose.rotation.row(1).cross(pose.rotation.row(2))) < 0) {
    throw BadDataError("camera " + camera.name +
                       ": its pose is not a rotation and a finite translation within 1e9 mm");
  }
}

namespace {

// A CT's slices and noise tilt single vertices by tens of degrees; weights that followed them would
// paint the stairs onto the skin. Slices are up to this thick.
constexpr double kStairsMm = 3;
constexpr std::size_t kGrain = 4096;

// Each round averages over a vertex's neighbours; n rounds reach about √n edges far. A mesh whose
// edges are longer than the stairs shows none and is left alone.
int averaging_rounds(const TriangleMesh& mesh) {
  constexpr double kMostRounds = 32;
  const double edge = mean_edge_length(mesh);
  return edge > 0 ? static_cast<int>(std::min(kMostRounds, std::pow(kStairsMm / edge, 2))) : 0;
}

// Each vertex gathers the sums of its faces in their order.
void average_over_neighbours(const TriangleMesh& mesh, int rounds,
                             std::vector<Eigen::Vector3d>& normals) {
  if (rounds == 0) return;
  const VertexFaces around(mesh.faces, mesh.vertices.size());
  std::vector<Eigen::Vector3d> sums(mesh.faces.size());
  for (int round = 0; round < rounds; ++round) {
    parallel_each(std::size_t{0}, sums.size(), kGrain, [&](std::size_t f) {
      const Face& face = mesh.faces[f];
      sums[f] = normals[face[0]] + normals[face[1]] + normals[face[2]];
    });
    parallel_each(std::size_t{0}, normals.size(), kGrain, [&](std::size_t v) {
      Eigen::Vector3d sum = normals[v];
      for (const std::uint32_t f : around.of(static_cast<std::uint32_t>(v))) sum += sums[f];
      const double length = sum.norm();
      if (length > 0) normals[v] = sum / length;
    });
  }
}

}  // namespace

SmoothNormals::SmoothNormals(const TriangleMesh& mesh)
    : mesh_(mesh), vertex_normals_(vertex_normals(mesh)), face_normals_(mesh.faces.size()) {
  average_over_neighbours(mesh, averaging_rounds(mesh), vertex_normals_);
  parallel_each(std::size_t{0}, mesh.faces.size(), kGrain,
                [&](std::size_t f) { face_normals_[f] = face_normal(mesh, f); });
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

namespace {

const TriangleMesh& checked(const TriangleMesh& surface) {
  check_mesh(surface, "surface");
  if (surface.empty()) throw BadDataError("surface: it has no faces");
  return surface;
}

}  // namespace

TracedSurface::TracedSurface(const TriangleMesh& surface)
    : mesh(checked(surface)), rays(surface), normals(surface) {}

}  // namespace organbake
