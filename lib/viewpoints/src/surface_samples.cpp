// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/viewpoints/surface_samples.h"

#include <array>
#include <cmath>
#include <utility>

#include "organbake/geometry/mesh_checks.h"

namespace organbake {

TriangleMesh painted_by_cameras(const TriangleMesh& surface, const Sight& sight,
                                const std::vector<Eye>& cameras, const std::vector<Eye>& region,
                                const SightLimits& well) {
  static const Eigen::Vector3f kUnreachable(0.2f, 0.2f, 0.2f);
  static const std::array<Eigen::Vector3f, 4> kByCameras = {
      Eigen::Vector3f(0.8f, 0.03f, 0.03f), Eigen::Vector3f(0.8f, 0.6f, 0.05f),
      Eigen::Vector3f(0.1f, 0.5f, 0.15f), Eigen::Vector3f(0.08f, 0.2f, 0.6f)};
  SurfaceSamples vertices;
  vertices.points = surface.vertices;
  vertices.normals = vertex_normals(surface);
  const std::vector<SampleBits> seen = sight.seen_from_each(cameras, vertices, well);
  const SampleBits reachable = sight.seen_from_any(region, vertices, well);
  TriangleMesh painted = surface;
  painted.colors.clear();
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const int times = times_in(seen, v, static_cast<int>(kByCameras.size()) - 1);
    painted.colors.push_back(times == 0 && !reachable.test(v) ? kUnreachable : kByCameras[times]);
  }
  return painted;
}

TriangleMesh poked_surface(TriangleMesh surface, const Poke& poke) {
  const double falloff = 0.5 / (poke.sigma_mm * poke.sigma_mm);
  for (Eigen::Vector3d& vertex : surface.vertices) {
    vertex += std::exp(-falloff * (vertex - poke.site_mm).squaredNorm()) * poke.displacement_mm;
  }
  return surface;
}

}  // namespace organbake
