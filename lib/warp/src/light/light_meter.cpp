// SPDX-License-Identifier: Apache-2.0
// What is found before any pixel is lit: the exposure of the light at the scope, and the table of
// noise that the skin's grain is looked up in.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "light/relit_skin.h"
#include "light/scope_shine.h"
#include "picture/spans.h"

namespace organbake {
namespace {

// What faces tell: their weights, and weight · light at 1 mm.
struct Reading {
  double weight = 0, light = 0;
};

struct LightMeter {
  const ScopeLight& scope;
  Eigen::Vector2d slopes_at_border;  // of the picture's sides
  double inverse_tan2_half;

  // Of a face, camera axes.
  Reading read(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) const {
    constexpr double kNearest_mm = 1;
    const Eigen::Vector3d middle = (a + b + c) / 3;
    const Eigen::Vector3d area = (b - a).cross(c - a);  // doubled
    const double range = std::max(middle.norm(), kNearest_mm);
    const double seen = -area.dot(middle) / (range * range * range);  // doubled solid angle
    if (!(seen > 0 && middle.z() > 0)) return {};
    // 1 amid the picture, a half at its border, little beyond.
    const Eigen::Vector2d place = (middle.head<2>() / middle.z()).cwiseQuotient(slopes_at_border);
    const double weight = seen / (1 + place.squaredNorm() * place.squaredNorm());
    const Eigen::Vector3d toward = scope.offset_mm - middle;
    const double range2 = std::max(toward.squaredNorm(), kNearest_mm * kNearest_mm);
    const double cosine =
        std::max(0.0, area.dot(toward)) / std::max(1e-300, area.norm() * std::sqrt(range2));
    const double ahead2 = toward.z() < 0 ? toward.z() * toward.z() / range2 : 0;
    const double beam = ahead2 / (ahead2 + (1 - ahead2) * inverse_tan2_half + 1e-12);
    return {weight, weight * cosine * beam / range2};
  }
};

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

// The gradient at a corner of the lattice, which repeats, along the way from there.
double ramp(const std::array<int, 3>& corner, const std::array<double, 3>& way) {
  std::uint32_t h = 40;
  for (const int at : corner)
    h = (h ^ static_cast<std::uint32_t>(at % SkinGrain::kGrains)) * 0x85ebca6bu + 0x9e3779b9u;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  h ^= h >> 16;
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += (((h >> (10 * k)) & 1023u) * (2.0 / 1023) - 1) * way[k];
  return sum;
}

double noise_at(const std::array<double, 3>& grains) {
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    std::array<int, 3> corner{};
    std::array<double, 3> way{};
    double weight = 1;
    for (int k = 0; k < 3; ++k) {
      const int up = c >> k & 1, low = static_cast<int>(grains[k]);
      corner[k] = low + up;
      way[k] = grains[k] - corner[k];
      weight *= up ? fade(grains[k] - low) : 1 - fade(grains[k] - low);
    }
    sum += weight * ramp(corner, way);
  }
  return sum;
}

}  // namespace

double metered_mm(const ScopeLight& scope, std::span<const TriangleMesh* const> proxies_at_rest,
                  const View& view, const DrawOptions& options) {
  constexpr double kMeanLight = 0.65, kUnlit_mm = 100;  // of full exposure; where nothing is seen
  if (options.light != DrawnLight::scope || options.scope_reference_mm > 0)
    return options.scope_reference_mm;
  if (scope.reference_mm > 0) return scope.reference_mm;
  const Intrinsics& lens = view.camera.intrinsics;
  const double tan_half = std::tan(scope.beam_half_angle_rad);
  const LightMeter meter{
      scope, {0.5 * lens.width / lens.fx, 0.5 * lens.height / lens.fy}, 1 / (tan_half * tan_half)};
  Reading sum;
  for (const TriangleMesh* const proxy : proxies_at_rest) {
    // All at once; and their sum one after the other, the same for any number of threads.
    std::vector<Reading> readings(proxy->faces.size());
    parallel_each(std::size_t{0}, readings.size(), std::size_t{256}, [&](std::size_t f) {
      const auto corner = [&](int c) -> Eigen::Vector3d {
        return view.camera.camera_from_world * proxy->vertices[proxy->faces[f][c]];
      };
      readings[f] = meter.read(corner(0), corner(1), corner(2));
    });
    for (const Reading& reading : readings)
      sum.weight += reading.weight, sum.light += reading.light;
  }
  return sum.light > 0 ? std::sqrt(kMeanLight * sum.weight / sum.light) : kUnlit_mm;
}

const std::vector<std::int8_t>& grain_noise() {
  static const std::vector<std::int8_t> noise = [] {
    constexpr double kNoiseDeviation = 0.19;
    std::vector<std::int8_t> values;
    const auto at = [](int k) { return (k + 0.5) / SkinGrain::kPerGrain; };
    for (int x = 0; x < kGrainSide; ++x)
      for (int y = 0; y < kGrainSide; ++y)
        for (int z = 0; z < kGrainSide; ++z) {
          const double value =
              SkinGrain::kDeviation / kNoiseDeviation * noise_at({at(x), at(y), at(z)});
          values.push_back(static_cast<std::int8_t>(std::lround(std::clamp(value, -127.0, 127.0))));
        }
    return values;
  }();
  return noise;
}

}  // namespace organbake
