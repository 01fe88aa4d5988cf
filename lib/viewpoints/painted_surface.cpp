// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints/painted_surface.h"

#include <algorithm>
#include <array>

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
  std::vector<std::uint8_t> times(vertices.size(), 0);
  for (const SampleBits& seen : sight.seen_from_each(cameras, vertices, well)) {
    for (std::size_t v = 0; v < times.size(); ++v) {
      times[v] = static_cast<std::uint8_t>(std::min(times[v] + (seen.test(v) ? 1 : 0), 3));
    }
  }
  const SampleBits reachable = sight.seen_from_any(region, vertices, well);
  TriangleMesh painted = surface;
  painted.colors.clear();
  for (std::size_t v = 0; v < times.size(); ++v) {
    painted.colors.push_back(times[v] == 0 && !reachable.test(v) ? kUnreachable
                                                                 : kByCameras[times[v]]);
  }
  return painted;
}

}  // namespace organbake
