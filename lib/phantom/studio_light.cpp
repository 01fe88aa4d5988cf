// SPDX-License-Identifier: GPL-3.0-or-later
#include "phantom/studio_light.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace organbake {
namespace {

using Eigen::Vector3d;

struct DirectionalLight {
  Vector3d toward;
  Vector3d color;
};
const std::array<DirectionalLight, 2> kLights = {{
    {Vector3d(-0.45, -0.75, 0.48).normalized(), {1.55, 1.49, 1.40}},  // key
    {Vector3d(0.62, 0.58, 0.10).normalized(), {0.60, 0.66, 0.75}},    // fill
}};
const Vector3d kAmbientAbove{0.50, 0.51, 0.53}, kAmbientBelow{0.32, 0.30, 0.28};

constexpr double kSheen = 0.045, kSheenExponent = 25;
constexpr double kGlint = 0.32, kGlintExponent = 180;

}  // namespace

Vector3d lit_diffuse(const Vector3d& albedo, const Vector3d& normal) {
  Vector3d light = kAmbientBelow + (kAmbientAbove - kAmbientBelow) * (0.5 + 0.5 * normal.z());
  for (const auto& lamp : kLights) light += lamp.color * std::max(0.0, normal.dot(lamp.toward));
  return albedo.cwiseProduct(light);
}

Vector3d lit_specular(const Vector3d& normal, const Vector3d& toward_eye) {
  Vector3d light = Vector3d::Zero();
  for (const auto& lamp : kLights) {
    if (normal.dot(lamp.toward) <= 0) continue;
    const double cosine = normal.dot((lamp.toward + toward_eye).normalized());
    if (cosine <= 0) continue;
    const double log_cosine = std::log(cosine);
    light += lamp.color * (kSheen * std::exp(kSheenExponent * log_cosine) +
                           kGlint * std::exp(kGlintExponent * log_cosine));
  }
  return light;
}

}  // namespace organbake
