// SPDX-License-Identifier: GPL-3.0-or-later
// Depth of one prepared frame by the model that is asked for: a lamp at the lens (laparoscope.cpp)
// or the paper's own method, a light from afar. In: brightness of one albedo and
// masks. Out: depth, normals, and how far each pixel can be trusted.
//   The paper's shape from shading (Tsai & Shah 1994) is one linearisation per pixel, without
// coupling between pixels. It is kept as it is published, but for the step's denominator
// (shape_from_shading.h), to compare with.
#include "organbake/shading/frame_depth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/shading/grid_filters.h"

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

namespace {

// How far the depth of each pixel can be trusted, 0…1: the cosine between surface and ray, times
// the signal over signal and noise, times how well the model explains the pixel. Filled pixels
// (highlights) have a quarter at most; instruments and the border 0.
//   log_range: relative ln r of albedo 1 for intensity / intensity_unit; noise: share of the unit.
Plane confidence_map(const PreparedFrame& frame, const Plane& log_range,
                     const std::vector<Eigen::Vector3f>& normals, const RayGrid& rays,
                     double intensity_unit, double noise) {
  constexpr double kFilled = 0.25, kMisfit = 0.15;
  Plane confidence(rays.width, rays.height);
  for (int y = 0; y < rays.height; ++y)
    for (int x = 0; x < rays.width; ++x) {
      const std::size_t k = confidence.index(x, y);
      if (!frame.tissue.values[k]) continue;
      const Eigen::Vector3d ray = Eigen::Vector3d(rays.x(x), rays.y(y), 1).normalized();
      const double cosine = std::max(0.0, -normals[k].cast<double>().dot(ray));
      double value = cosine;
      if (!frame.diffuse.values[k]) {
        value *= kFilled;
      } else {
        const double signal = frame.intensity.values[k] / intensity_unit;
        const double model = std::exp(-2.0 * log_range.values[k]) * cosine;
        const double misfit = (signal - model) / std::max(model, 1e-6) / kMisfit;
        value *= signal / (signal + 3 * noise + 0.02) / (1 + misfit * misfit);
      }
      confidence.values[k] = static_cast<float>(std::clamp(value, 0.0, 1.0));
    }
  return confidence;
}

void shade_near(const PreparedFrame& frame, const ShadingOptions& options,
                const FrameDepth* previous, FrameDepth& result) {
  RangeEstimate estimate =
      shade_laparoscope(frame.intensity, frame.diffuse, frame.camera, options.laparoscope,
                        previous ? &previous->range : nullptr, options.range_mm);
  const RayGrid rays = ray_grid(frame.camera);
  result.warm = estimate.warm;
  result.residual = estimate.misfit;
  result.quality = judge_depth(frame, estimate, previous ? &previous->quality : nullptr);
  if (options.relief) result.quality.kept = {*options.relief, *options.relief, *options.relief};
  result.confidence =
      confidence_map(frame, estimate.log_range, normals_from_log_range(estimate.log_range, rays),
                     rays, estimate.intensity_unit, estimate.noise);
  // Of a shape that the picture does not support a little is left: which frame is the best one is
  // still to be told.
  constexpr float kLeft = 0.1F;
  for (float& value : result.confidence.values)
    value *= kLeft + (1 - kLeft) * static_cast<float>(result.quality.support);
  Plane scaled = estimate.log_range;
  keep_relief(rays, frame.tissue, result.quality.kept, scaled);
  result.normals = normals_from_log_range(scaled, rays);
  double shift = -median_inside(scaled, frame.tissue);
  result.metric = true;
  if (options.range_mm > 0) {
    shift += std::log(options.range_mm);
  } else if (options.albedo > 0) {
    shift = 0.5 * std::log(options.albedo / estimate.intensity_unit);
  } else {
    result.metric = false;
  }
  for (float& value : scaled.values) value += static_cast<float>(shift);
  result.depth = depth_from_log_range(scaled, rays, frame.tissue);
  result.range = std::move(estimate);
}

// 0…1, with gaps filled: what the paper's method, which knows no masks, is given.
Plane unit_intensity(const PreparedFrame& frame, double albedo) {
  Plane intensity = frame.intensity;
  for (float& value : intensity.values)
    value = std::clamp(value / static_cast<float>(albedo), 0.F, 1.F);
  fill_outside(intensity, frame.diffuse);
  return intensity;
}

// Pixels of depth about a mean of 0, seen from afar, as planar depth about the frame's own range.
void place_relief(const PreparedFrame& frame, const ShadingOptions& options, const Plane& relief_px,
                  FrameDepth& result) {
  const double range = options.range_mm > 0 ? options.range_mm : 1;
  const double per_pixel = range / frame.camera.fx;
  const double middle = median_inside(relief_px, frame.tissue);
  const int width = relief_px.width, height = relief_px.height;
  result.metric = options.range_mm > 0;
  result.depth = Plane(width, height, std::numeric_limits<float>::infinity());
  result.confidence = Plane(width, height);
  Plane log_range(width, height);
  const RayGrid rays = ray_grid(frame.camera);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double z =
          std::max(0.05 * range, range + per_pixel * (double(relief_px.at(x, y)) - middle));
      const double along = std::hypot(1.0, rays.x(x), rays.y(y));
      log_range.at(x, y) = static_cast<float>(std::log(z * along));
      if (!frame.tissue.at(x, y)) continue;
      result.depth.at(x, y) = static_cast<float>(z);
      // A distant light in front of a near camera is a poor model: never more than half.
      result.confidence.at(x, y) = frame.diffuse.at(x, y) ? 0.5F : 0.125F;
    }
  result.normals = normals_from_log_range(log_range, rays);
}

void shade_far(const PreparedFrame& frame, const ShadingOptions& options,
               const FrameDepth* previous, FrameDepth& result) {
  const LightEstimate estimated = estimate_light(frame.intensity, frame.diffuse);
  result.light = options.light ? *options.light : previous ? previous->light : estimated.light;
  const Plane intensity = unit_intensity(frame, std::max(estimated.albedo, 1e-9));
  constexpr int kIterations = 20;
  TsaiShahEstimate estimate = shade_tsai_shah(intensity, {result.light, kIterations},
                                              previous ? &previous->tsai_shah_depth : nullptr);
  result.residual = estimate.residual;
  Plane relief(intensity.width, intensity.height);
  for (std::size_t k = 0; k < relief.size(); ++k)
    relief.values[k] = static_cast<float>(estimate.depth.values[k]);
  result.tsai_shah_depth = std::move(estimate.depth);
  place_relief(frame, options, relief, result);
  result.warm = previous != nullptr;
  result.quality = {DepthVerdict::doubtful, "a light from afar is no model of an endoscope's lamp",
                    1, 0};
}

}  // namespace

void ShadingOptions::check() const {
  laparoscope.check();
  if (range_mm != 0 && !(range_mm >= 1 && range_mm < 1e5))
    throw UsageError("range_mm is " + to_text(range_mm) +
                     "; it must be in 1…100000 mm (60, not 0.06, for 6 cm), or 0 where it is not "
                     "known");
  if (!(albedo >= 0 && albedo < 1e12))
    throw UsageError("albedo is " + to_text(albedo) + "; it must not be negative");
  if (relief && !(*relief >= 0 && *relief <= 1))
    throw UsageError("relief is " + to_text(*relief) + "; it must be auto or in 0…1");
}

FrameDepth shade_frame(const PreparedFrame& frame, const ShadingOptions& options,
                       const FrameDepth* previous) {
  options.check();
  FrameDepth result;
  if (options.model == ShadingModel::laparoscope) {
    shade_near(frame, options, previous, result);
  } else {
    shade_far(frame, options, previous, result);
  }
  return result;
}

}  // namespace organbake
