// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/colored_surface.h"

#include <algorithm>
#include <limits>

#include "organbake/core/parallel.h"
#include "organbake/geometry/refine.h"

namespace organbake {

TriangleMesh colored_surface(const TracedSurface& surface, const SurfaceColor& color,
                             double finest_mm) {
  RefinedMesh fine = refine_edges(
      surface.mesh, finest_mm > 0 ? finest_mm : std::numeric_limits<double>::infinity());
  fine.mesh.colors.resize(fine.mesh.vertices.size());
  constexpr std::size_t kPiece = 2048;  // enough work for a thread, few enough to stay in cache
  const auto color_piece = [&](std::size_t first, std::size_t last) {
    std::vector<Eigen::Vector3d> points, at;
    std::vector<RayHit> hits;
    for (std::size_t i = first; i < last; ++i) {
      const SurfacePlace& place = fine.places[i];
      hits.push_back({place.face, 0, place.u, place.v});
      points.push_back(fine.mesh.vertices[i]);
      at.push_back(surface.normals.at(hits.back()));
    }
    std::vector<Eigen::Vector3f> shaded;
    color.shade(points, at, hits, shaded);
    std::copy(shaded.begin(), shaded.end(),
              fine.mesh.colors.begin() + static_cast<std::ptrdiff_t>(first));
  };
  parallel_pieces(std::size_t{0}, fine.mesh.vertices.size(), kPiece, color_piece);
  return std::move(fine.mesh);
}

}  // namespace organbake
