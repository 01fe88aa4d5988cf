// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "organ.h"
#include "organbake/geometry/icosphere.h"
#include "organbake/phantom/phantom.h"

namespace organbake {

Eigen::Vector3d Organ::diffuse(const Eigen::Vector3d& world_mm,
                               const Eigen::Vector3d& normal) const {
  return texture.albedo(world_mm).cwiseProduct(studio_lighting().diffuse(normal));
}

TriangleMesh organ_surface(const Organ& organ, int subdivisions, bool colored,
                           const RunContext& context) {
  TriangleMesh mesh = make_icosphere(subdivisions);
  if (colored) mesh.colors.resize(mesh.vertices.size());
  const auto raise = [&](std::size_t v) {
    mesh.vertices[v] = organ.shape.surface_point(mesh.vertices[v]);
    if (!colored) return;
    const Eigen::Vector3d normal = -organ.shape.sample(mesh.vertices[v]).gradient.normalized();
    mesh.colors[v] = organ.diffuse(mesh.vertices[v], normal).cwiseMin(1.0).cast<float>();
  };
  constexpr std::size_t kVerticesAtOnce = 4096;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.vertices.size(), kVerticesAtOnce),
                    [&](const auto& vertices) {
                      context.throw_if_cancelled();
                      for (auto v = vertices.begin(); v != vertices.end(); ++v) raise(v);
                    });
  return mesh;
}

}  // namespace organbake
