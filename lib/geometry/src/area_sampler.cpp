// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/area_sampler.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

std::vector<double> cumulative_areas(const TriangleMesh& mesh) {
  std::vector<double> cumulative(mesh.faces.size());
  double sum = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) cumulative[f] = sum += face_area(mesh, f);
  return cumulative;
}

}  // namespace

AreaSampler::AreaSampler(const TriangleMesh& mesh, std::size_t samples, std::uint64_t seed)
    : mesh_(mesh), cumulative_(cumulative_areas(mesh)), samples_(samples), seed_(seed) {
  if (mesh.empty() || !(cumulative_.back() > 0) || !std::isfinite(cumulative_.back())) {
    throw BadDataError("mesh to measure from: its faces have no (finite) area");
  }
}

AreaSampler::Sample AreaSampler::at(std::size_t i) const {
  RandomStream random(seed_, i);
  const double target = (i + random.uniform()) / samples_ * cumulative_.back();
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, target);
  const auto index = static_cast<std::uint32_t>(found - cumulative_.begin());
  const Face& face = mesh_.faces[index];
  const double r = std::sqrt(random.uniform()), s = random.uniform();
  const Eigen::Vector3d weights(1 - r, r * (1 - s), r * s);
  return {index, weights,
          weights[0] * mesh_.vertices[face[0]] + weights[1] * mesh_.vertices[face[1]] +
              weights[2] * mesh_.vertices[face[2]]};
}

}  // namespace organbake
