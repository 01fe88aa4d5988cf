// SPDX-License-Identifier: GPL-3.0-or-later
// Shading as a weighted sum of basis functions: a lamp at the camera, spherical harmonics of
// unknown distant light (Ramamoorthi & Hanrahan 2001), a beam to first order. Being linear, the
// light is solved for at every pose and never searched.
#include "organbake/registration/light_model.h"

#include <algorithm>
#include <cmath>

namespace organbake {

using Eigen::Vector3d;

namespace {

int size_of(LightModel model) {
  switch (model) {
    case LightModel::estimated:
      return ShadingBasis::kMost;
    case LightModel::beam:
      return 8;
    default:
      return 2;
  }
}

// How a beam's strength varies over the picture and with the distance, and its slope by the point.
struct Beam {
  double u, v, u2_v2, log_r;

  Beam(const Vector3d& x, double reference_mm)
      : u(x.x() / x.z()),
        v(x.y() / x.z()),
        u2_v2(u * u + v * v),
        log_r(std::log(x.norm() / reference_mm)) {}
  double sum(const ShadingBasis::Weights& w) const {
    return w[0] + w[1] * u + w[2] * v + w[3] * u2_v2 + w[4] * log_r;
  }
  Vector3d slope(const Vector3d& x, const ShadingBasis::Weights& w) const {
    const double by_u = w[1] + 2 * w[3] * u, by_v = w[2] + 2 * w[3] * v;
    return Vector3d(by_u, by_v, -by_u * u - by_v * v) / x.z() + w[4] / x.squaredNorm() * x;
  }
};

}  // namespace

const char* name_of(LightModel model) {
  switch (model) {
    case LightModel::automatic:
      return "auto";
    case LightModel::camera:
      return "camera";
    case LightModel::beam:
      return "beam";
    case LightModel::direction:
      return "direction";
    default:
      return "estimated";
  }
}

ShadingBasis::ShadingBasis(const Light& light, double reference_mm)
    : light_(light),
      reference2_(reference_mm * reference_mm),
      reference_mm_(reference_mm),
      size_(size_of(light.model)) {
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
  if (light_.model == LightModel::beam) {
    const Beam beam(x, reference_mm_);
    phi[1] = phi[0] * beam.u;
    phi[2] = phi[0] * beam.v;
    phi[3] = phi[0] * beam.u2_v2;
    phi[4] = phi[0] * beam.log_r;
    // Of n · d / |d|³ by the lamp's place, d from the point to the lamp.
    const double by_n = reference2_ * reference_mm_ / (r2 * std::sqrt(r2));
    const double by_x = -3 * n.dot(x) / r2;
    phi[5] = by_n * (n.x() + by_x * x.x());
    phi[6] = by_n * (n.y() + by_x * x.y());
  }
  if (light_.model != LightModel::estimated) return;
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
  const bool shaped = light_.model == LightModel::beam;
  const double lamp = reference2_ / (r2 * std::sqrt(r2));
  if (facing > 0) {
    const Beam beam(x, reference_mm_);
    const double scale = (shaped ? beam.sum(w) : w[0]) * lamp;
    g.by_point = -scale * (n + 3 * facing / r2 * x);
    g.by_normal = -scale * x;
    if (shaped) g.by_point += lamp * facing * beam.slope(x, w);
  }
  if (shaped) {
    const Vector3d place(w[5], w[6], 0);  // of the lamp, weighted
    const double scale = lamp * reference_mm_, aside = place.dot(x) / r2;
    g.by_normal += scale * (place - 3 * aside * x);
    g.by_point +=
        3 * scale / r2 * (-n.dot(place) * x - aside * r2 * n + n.dot(x) * (5 * aside * x - place));
  }
  if (light_.model != LightModel::estimated) return g;
  g.by_normal += Vector3d(w[1] + w[4] * n.y() + w[6] * n.z() + 2 * w[7] * n.x(),
                          w[2] + w[4] * n.x() + w[5] * n.z() - 2 * w[7] * n.y(),
                          w[3] + w[5] * n.y() + w[6] * n.x() + 6 * w[8] * n.z());
  return g;
}

}  // namespace organbake
