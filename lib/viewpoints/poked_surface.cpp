// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints/surface_samples.h"

#include <cmath>

namespace organbake {

TriangleMesh poked_surface(TriangleMesh surface, const Poke& poke) {
  const double falloff = 0.5 / (poke.sigma_mm * poke.sigma_mm);
  for (Eigen::Vector3d& vertex : surface.vertices) {
    vertex += std::exp(-falloff * (vertex - poke.site_mm).squaredNorm()) * poke.displacement_mm;
  }
  return surface;
}

}  // namespace organbake
