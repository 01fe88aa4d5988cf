// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitted_proxy.h"

#include "organbake/decimate/mesh_defects.h"

namespace organbake {

TriangleMesh keep_apart(const TriangleMesh& before, TriangleMesh after) {
  constexpr int kHalvings = 4, kAttempts = 8;
  std::vector<std::uint32_t> bad = self_intersecting_faces(after);
  if (bad.empty()) return after;
  const std::size_t allowed = self_intersecting_faces(before).size();
  for (int attempt = 0; attempt < kAttempts && bad.size() > allowed; ++attempt) {
    std::vector<bool> draw(after.vertices.size(), false);
    for (const std::uint32_t f : bad) {
      for (const std::uint32_t v : after.faces[f]) draw[v] = true;
    }
    const double share = attempt < kHalvings ? 0.5 : 1.0;
    for (std::size_t v = 0; v < draw.size(); ++v) {
      if (draw[v]) after.vertices[v] += share * (before.vertices[v] - after.vertices[v]);
    }
    bad = self_intersecting_faces(after);
  }
  return bad.size() > allowed ? before : after;
}

}  // namespace organbake
