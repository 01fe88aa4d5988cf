// SPDX-License-Identifier: GPL-3.0-or-later
// Alpha wrapping with an offset (Portaneri et al. 2022; CGAL), with its vertices pulled back onto
// the surface by the offset that the method leaves.
#include "repair_steps.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <array>
#include <vector>

#include "organbake/core/parallel.h"
#include "organbake/decimate/mesh_measures.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;

// The wrap lies this share of what it closes off the surface.
constexpr double kOffsetShare = 0.1;
// Vertices nearer than so many offsets belong to the surface, others span a gap.
constexpr double kNearOffsets = 1.5;

void pull_back(TriangleMesh& wrap, const TriangleMesh& surface, double offset_mm) {
  const RayScene scene(surface);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(wrap);
  std::vector<Eigen::Vector3d> pulled(wrap.vertices.size());
  parallel_for(std::size_t{0}, wrap.vertices.size(), [&](std::size_t v) {
    const ClosestPoint nearest = scene.closest_point(wrap.vertices[v]);
    pulled[v] = nearest.distance_mm <= kNearOffsets * offset_mm
                    ? nearest.point
                    : Eigen::Vector3d(wrap.vertices[v] - offset_mm * normals[v]);
  });
  wrap.vertices = std::move(pulled);
}

}  // namespace

TriangleMesh wrapped_surface(const TriangleMesh& surface, double closes_mm) {
  std::vector<Kernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> faces;
  for (const Eigen::Vector3d& v : surface.vertices) points.emplace_back(v.x(), v.y(), v.z());
  for (const Face& f : surface.faces) faces.push_back({f[0], f[1], f[2]});
  const double offset_mm = kOffsetShare * closes_mm;
  SurfaceMesh wrap;
  CGAL::alpha_wrap_3(points, faces, closes_mm, offset_mm, wrap);
  TriangleMesh mesh = triangles_of(
      wrap, [](const Kernel::Point_3& p) { return Eigen::Vector3d(p.x(), p.y(), p.z()); });
  if (!mesh.empty()) pull_back(mesh, surface, offset_mm);
  return mesh;
}

}  // namespace organbake
