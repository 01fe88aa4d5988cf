// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/shading.h"

#include <algorithm>
#include <cmath>

namespace organbake {

using Eigen::Vector3d;

ShadingBasis::ShadingBasis(const Light& light, double reference_mm)
    : light_(light),
      reference2_(reference_mm * reference_mm),
      size_(light.model == LightModel::estimated ? kMost : 2) {
  light_.toward.normalize();
}

ShadingBasis::Weights ShadingBasis::first_weights() const {
  Weights weights = Weights::Zero();
  weights[0] = 1;
  return weights;
}

void ShadingBasis::values(const Vector3d& x, const Vector3d& n, double* phi) const {
  phi[size_ - 1] = 0;
  if (light_.model == LightModel::direction) {
    phi[0] = light_.ambient + (1 - light_.ambient) * std::max(0.0, n.dot(light_.toward));
    return;
  }
  const double r2 = x.squaredNorm();
  phi[0] = std::max(0.0, -n.dot(x)) * reference2_ / (r2 * std::sqrt(r2));
  if (light_.model == LightModel::camera) return;
  phi[1] = n.x();
  phi[2] = n.y();
  phi[3] = n.z();
  phi[4] = n.x() * n.y();
  phi[5] = n.y() * n.z();
  phi[6] = n.x() * n.z();
  phi[7] = n.x() * n.x() - n.y() * n.y();
  phi[8] = 3 * n.z() * n.z() - 1;
}

ShadingBasis::Gradient ShadingBasis::gradient(const Vector3d& x, const Vector3d& n,
                                              const Weights& w) const {
  Gradient g;
  if (light_.model == LightModel::direction) {
    if (n.dot(light_.toward) > 0) g.by_normal = w[0] * (1 - light_.ambient) * light_.toward;
    return g;
  }
  const double facing = -n.dot(x), r2 = x.squaredNorm();
  if (facing > 0) {
    const double scale = w[0] * reference2_ / (r2 * std::sqrt(r2));
    g.by_point = -scale * (n + 3 * facing / r2 * x);
    g.by_normal = -scale * x;
  }
  if (light_.model == LightModel::camera) return g;
  g.by_normal += Vector3d(w[1] + w[4] * n.y() + w[6] * n.z() + 2 * w[7] * n.x(),
                          w[2] + w[4] * n.x() + w[5] * n.z() - 2 * w[7] * n.y(),
                          w[3] + w[5] * n.y() + w[6] * n.x() + 6 * w[8] * n.z());
  return g;
}

}  // namespace organbake
