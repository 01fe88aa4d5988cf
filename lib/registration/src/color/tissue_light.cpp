// SPDX-License-Identifier: GPL-3.0-or-later
// Lamp, beam, fall-off and albedo of living tissue as logarithms, where they add up, and their
// slopes.
#include "color/tissue_light.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kGrazing = 0.03;  // cosine: what faces less is lit as by what is around it

// From the point to the lamp, and how much of its length lies along the normal.
struct Way {
  Vector3d lamp;
  double along, squared;
  bool grazing;

  Way(const Vector3d& point, const Vector3d& normal, const TissueLight::Weights& w)
      : lamp(Vector3d(w[TissueLight::kLampX], w[TissueLight::kLampY], 0) - point),
        along(normal.dot(lamp)),
        squared(lamp.squaredNorm()),
        grazing(along < kGrazing * std::sqrt(squared)) {
    if (grazing) along = kGrazing * std::sqrt(squared);
  }
};

}  // namespace

TissueLight::Expected TissueLight::expected() {
  Expected e{Weights::Zero(), Weights::Zero()};
  e.sd[kGain] = 100;                          // exposure is anyone's
  e.sd[kLampX] = e.sd[kLampY] = 6;            // mm: the rim of a laparoscope
  e.sd[kTiltU] = e.sd[kTiltV] = 0.5;          // a beam that points half a picture aside
  e.mean[kBeam] = -1, e.sd[kBeam] = 1.5;      // weaker to the sides
  e.sd[kFalloff] = 0.3;                       // of the power of the distance
  e.mean[kGround] = -5.3, e.sd[kGround] = 1;  // dark
  for (int i = 0; i < kHues; ++i) e.sd[kHue + i] = i < 2 ? 0.3 : 0.1;
  return e;
}

double log_radiance(const Vector3d& point, const Vector3d& normal, const TissueLight::Weights& w,
                    double reference_mm) {
  const Way way(point, normal, w);
  const double u = point.x() / point.z(), v = point.y() / point.z();
  return w[TissueLight::kGain] + std::log(way.along) - 1.5 * std::log(way.squared) +
         2 * std::log(reference_mm) + w[TissueLight::kTiltU] * u + w[TissueLight::kTiltV] * v +
         w[TissueLight::kBeam] * std::log(1 + u * u + v * v) +
         w[TissueLight::kFalloff] * std::log(point.norm() / reference_mm);
}

LogRadianceSlopes log_radiance_slopes(const Vector3d& point, const Vector3d& normal,
                                      const TissueLight::Weights& w, double reference_mm) {
  const Way way(point, normal, w);
  const double u = point.x() / point.z(), v = point.y() / point.z(), q = 1 + u * u + v * v;
  LogRadianceSlopes s;
  s.by_normal = way.grazing ? Vector3d::Zero() : Vector3d(way.lamp / way.along);
  const Vector3d by_cosine = way.grazing ? Vector3d::Zero() : Vector3d(normal / way.along);
  const Vector3d by_lamp = by_cosine - 3 / way.squared * way.lamp;
  const double by_u = w[TissueLight::kTiltU] + 2 * w[TissueLight::kBeam] * u / q;
  const double by_v = w[TissueLight::kTiltV] + 2 * w[TissueLight::kBeam] * v / q;
  s.by_point = -by_lamp + Vector3d(by_u, by_v, -by_u * u - by_v * v) / point.z() +
               w[TissueLight::kFalloff] / point.squaredNorm() * point;
  s.by_weight << 1, by_lamp.x(), by_lamp.y(), u, v, std::log(q),
      std::log(point.norm() / reference_mm);
  return s;
}

}  // namespace organbake
