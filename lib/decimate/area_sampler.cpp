// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimate/area_sampler.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/random.h"

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

Eigen::Vector3d AreaSampler::operator()(std::size_t i) const {
  RandomStream random(seed_, i);
  const double target = (i + random.uniform()) / samples_ * cumulative_.back();
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, target);
  const Face& face = mesh_.faces[found - cumulative_.begin()];
  const double r = std::sqrt(random.uniform()), s = random.uniform();
  return (1 - r) * mesh_.vertices[face[0]] + r * (1 - s) * mesh_.vertices[face[1]] +
         r * s * mesh_.vertices[face[2]];
}

}  // namespace organbake
