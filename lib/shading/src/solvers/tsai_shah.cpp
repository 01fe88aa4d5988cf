// SPDX-License-Identifier: GPL-3.0-or-later
// The paper's shape from shading (Tsai & Shah 1994): one linearisation per pixel, no coupling
// between pixels. Kept as it is published, but for the step's denominator (tsai_shah.h), to compare
// with.
#include "organbake/shading/tsai_shah.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"

namespace organbake {
namespace {

// f and df/dZ of one pixel.
struct Linearised {
  double f, df;
};

Linearised linearise(double intensity, double p, double q, const Eigen::Vector3d& s) {
  const double w2 = 1 + p * p + q * q, w = std::sqrt(w2);
  const double facing = p * s.x() + q * s.y() + s.z();
  return {intensity - std::max(0.0, facing / w), (p + q) * facing / (w2 * w) - (s.x() + s.y()) / w};
}

}  // namespace

void TsaiShahOptions::check() const {
  if (!(iterations >= 1 && iterations <= 1'000'000))
    throw UsageError("iterations is " + std::to_string(iterations) + "; it must be in 1…1000000");
  if (!std::isfinite(light.tilt_rad) || !std::isfinite(light.slant_rad))
    throw UsageError("the light's tilt and slant must be finite numbers");
}

TsaiShahEstimate shade_tsai_shah(const Plane& intensity, const TsaiShahOptions& options,
                                 const Grid<double>* start) {
  options.check();
  const int width = intensity.width, height = intensity.height;
  if (start && (start->width != width || start->height != height))
    throw BadDataError("shading: the previous depth and the image are of different sizes");
  constexpr double kW = 1e-8;
  const Eigen::Vector3d toward = options.light.toward();
  Grid<double> z = start ? *start : Grid<double>(width, height), next = z;
  Grid<double> gain(width, height, kW);
  double squares = 0;
  for (int n = 0; n < options.iterations; ++n) {
    squares = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const bool border = x == 0 || y == 0;
        const double p = border ? 0 : z.at(x, y) - z.at(x - 1, y);
        const double q = border ? 0 : z.at(x, y) - z.at(x, y - 1);
        const float value = intensity.at(x, y);
        const auto [f, df] = linearise(std::isfinite(value) ? value : 0, p, q, toward);
        gain.at(x, y) += df * df;
        next.at(x, y) = z.at(x, y) - df / gain.at(x, y) * f;
        squares += f * f;
      }
    z.values.swap(next.values);
  }
  const double pixels = std::max<double>(1, static_cast<double>(z.size()));
  return {std::move(z), std::sqrt(squares / pixels)};
}

}  // namespace organbake
