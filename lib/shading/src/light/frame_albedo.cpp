// SPDX-License-Identifier: GPL-3.0-or-later
// A frame divided by its light, as the shape that was found in it says, and without highlights.
#include "organbake/shading/frame_albedo.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "light/divided_light.h"
#include "light/highlight_fill.h"
#include "light/linear_color.h"
#include "organbake/core/error.h"
#include "organbake/core/median.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/ray_grid.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Beyond, noise and a wrong normal would make more of a pixel than its light did.
constexpr double kGrazing = 0.15;

// What the light does at each pixel of the tissue: irradiance is full · cosine · falloff.
struct LitSurface {
  Plane falloff;  // 1/r² with the beam, in 1/unit²; 0 where there is no tissue
  Plane cosine;
};

LitSurface lit_surface(const PreparedFrame& frame, const FrameDepth& depth, const ScopeLight& light,
                       double mm_per_unit) {
  const RayGrid rays = ray_grid(frame.camera);
  const double tan_half = std::tan(light.beam_half_angle_rad);
  LitSurface lit{Plane(rays.width, rays.height), Plane(rays.width, rays.height)};
  for (int y = 0; y < rays.height; ++y)
    for (int x = 0; x < rays.width; ++x) {
      const std::size_t k = lit.falloff.index(x, y);
      const double z = depth.depth.values[k];
      if (!std::isfinite(z)) continue;
      const Vector3d point = z * Vector3d(rays.x(x), rays.y(y), 1);
      const Vector3d toward = light.offset_mm / mm_per_unit - point;
      const double range2 = toward.squaredNorm();
      const double off_axis2 = toward.head<2>().squaredNorm() / (toward.z() * toward.z());
      const double beam = 1 / (1 + off_axis2 / (tan_half * tan_half));
      const double cosine = depth.normals[k].cast<double>().dot(toward) / std::sqrt(range2);
      lit.falloff.values[k] = static_cast<float>(beam / range2);
      lit.cosine.values[k] = static_cast<float>(std::max(kGrazing, cosine));
    }
  return lit;
}

// The median range of the tissue that counts: 1/√ of its fall-off.
double median_range(const LitSurface& lit, const Mask& counts) {
  std::vector<float> ranges;
  for (std::size_t k = 0; k < counts.size(); ++k)
    if (counts.values[k] && lit.falloff.values[k] > 0)
      ranges.push_back(1 / std::sqrt(lit.falloff.values[k]));
  if (ranges.empty())
    throw BadDataError(
        "no tissue of the frame is free of highlights; is the frame masked altogether?");
  return median(std::move(ranges));
}

// Of ln luminance with the logarithm of a light, over the pixels given.
double correlation(const LinearColor& color, const Plane& light, const Mask& where) {
  double count = 0, sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t k = 0; k < light.size(); ++k) {
    const float bright = luminance(color[0].values[k], color[1].values[k], color[2].values[k]);
    if (!where.values[k] || !(light.values[k] > 0) || !(bright > 0)) continue;
    const double a = std::log(bright), b = std::log(light.values[k]);
    ++count, sum_a += a, sum_b += b, aa += a * a, bb += b * b, ab += a * b;
  }
  const double spread =
      std::max(0.0, aa - sum_a * sum_a / count) * std::max(0.0, bb - sum_b * sum_b / count);
  return count > 1 && spread > 0 ? (ab - sum_a * sum_b / count) / std::sqrt(spread) : 0;
}

Rgb8Image picture_of(const LinearColor& color, const Mask& tissue) {
  Rgb8Image picture(tissue.width, tissue.height);
  for (std::size_t k = 0; k < tissue.size(); ++k) {
    if (!tissue.values[k]) continue;
    for (int c = 0; c < 3; ++c)
      picture.pixels[3 * k + c] = srgb8_from_linear(std::clamp(color[c].values[k], 0.F, 1.F));
  }
  return picture;
}

}  // namespace

namespace {

// cosⁿ has half its light where the player's beam is given its half; n = 2 is the same beam.
constexpr double kWidest_rad = 1.5;

double half_angle_of(double beam_exponent) {
  return std::min(kWidest_rad, std::acos(std::pow(0.5, 1 / beam_exponent)));
}

}  // namespace

LaparoscopeOptions lamp_of(const Lighting& lighting, const std::string& name) {
  if (!lighting.scope)
    throw BadDataError(name +
                       ": holds no light at the scope; `organbake stereo` writes one that does");
  LaparoscopeOptions lamp;
  lamp.light_offset_x_mm = lighting.scope->offset_mm.x();
  lamp.light_offset_y_mm = lighting.scope->offset_mm.y();
  const double half_rad = lighting.scope->beam_half_angle_rad;
  lamp.beam_exponent = half_rad < kWidest_rad ? std::log(0.5) / std::log(std::cos(half_rad)) : 0;
  return lamp;
}

Lighting laparoscope_lighting(const LaparoscopeOptions& options) {
  ScopeLight scope;
  scope.offset_mm = {options.light_offset_x_mm, options.light_offset_y_mm, 0};
  scope.beam_half_angle_rad =
      options.beam_exponent > 0 ? half_angle_of(options.beam_exponent) : kWidest_rad;
  Lighting lighting;
  lighting.ambient_above = lighting.ambient_below = Vector3d::Ones();  // colours are the albedo
  lighting.gloss = wet_gloss();
  lighting.scope = scope;
  lighting.finish = {.relief_slope = 0.1, .relief_mm = 1.5, .rim = 0.12, .border_fade_rad = 0.01};
  return lighting;
}

FrameAlbedo divide_light_out(const PreparedFrame& frame, const FrameDepth& depth,
                             const LaparoscopeOptions& options, double mm_per_unit) {
  const LitSurface lit =
      lit_surface(frame, depth, *laparoscope_lighting(options).scope, mm_per_unit);
  const Mask clear = clear_tissue(frame);
  FrameAlbedo albedo;
  albedo.reference_mm = mm_per_unit * median_range(lit, clear);
  const LinearColor seen = linear_color(frame.color);
  albedo.falloff_before = correlation(seen, lit.falloff, clear);
  albedo.cosine_before = correlation(seen, lit.cosine, clear);
  const double reference = albedo.reference_mm / mm_per_unit;
  const auto full = static_cast<float>(reference * reference);
  Plane light = lit.falloff;
  for (std::size_t k = 0; k < light.size(); ++k) light.values[k] *= full * lit.cosine.values[k];
  LinearColor color = divided_by_light(frame.color, light, clear);
  take_highlights_out(frame, clear, color);
  albedo.falloff_left = correlation(color, lit.falloff, clear);
  albedo.cosine_left = correlation(color, lit.cosine, clear);
  albedo.color = picture_of(color, frame.tissue);
  return albedo;
}

}  // namespace organbake
