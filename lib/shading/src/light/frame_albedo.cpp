// SPDX-License-Identifier: GPL-3.0-or-later
// A frame divided by its light. Highlights and their glow are told from tissue by the dichromatic
// model (Shafer 1985): what is mirrored has the lamp's colour, the rest the tissue's own.
#include "organbake/shading/frame_albedo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/median.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"
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

using LinearColor = std::array<Plane, 3>;

LinearColor linear_color(const Rgb8Image& frame) {
  LinearColor linear;
  for (int c = 0; c < 3; ++c) {
    linear[c] = Plane(frame.width, frame.height);
    for (std::size_t k = 0; k < linear[c].size(); ++k)
      linear[c].values[k] = linear_from_srgb8()[frame.pixels[3 * k + c]];
  }
  return linear;
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

int share_of_side(const PreparedFrame& frame, int share) {
  return std::max(1, std::max(frame.color.width, frame.color.height) / share);
}

// Where the frame's own brightness stands for tissue: not on highlights nor on their rims.
Mask clear_tissue(const PreparedFrame& frame) {
  const Mask clear = without(frame.diffuse, dilated(frame.highlights, 1));
  const bool any = std::any_of(clear.values.begin(), clear.values.end(),
                               [](std::uint8_t value) { return value != 0; });
  return any ? clear : frame.diffuse;
}

// Round a highlight lies its glow, and tissue that mirrors a little. What is mirrored is white, and
// adds to the tissue's colour (the dichromatic model; Shafer 1985): with the colour of the tissue
// around, least squares over the three channels tell the two apart, and the texture stays.
void take_glow_out(const PreparedFrame& frame, const Mask& clear, LinearColor& color) {
  constexpr int kGlowShare = 24, kAroundShare = 40;  // of the longer side
  constexpr float kNoise = 0.05F;  // of the tissue's luminance: less white is no glow
  constexpr float kLeast = 0.75F;  // of the colour around: pale tissue is white by itself
  const Mask near = dilated(frame.highlights, share_of_side(frame, kGlowShare));
  const Mask free = without(clear, near);
  const Mask everywhere(clear.width, clear.height, 1);
  LinearColor around = color;
  for (Plane& plane : around) {
    fill_outside(plane, free);
    plane = box_mean(plane, everywhere, share_of_side(frame, kAroundShare));
  }
  for (std::size_t k = 0; k < clear.size(); ++k) {
    if (!clear.values[k] || !near.values[k]) continue;
    const Eigen::Vector3f tissue(around[0].values[k], around[1].values[k], around[2].values[k]);
    const Eigen::Vector3f seen(color[0].values[k], color[1].values[k], color[2].values[k]);
    const float own = tissue.sum() / 3;
    const Eigen::Vector3f tint = tissue - Eigen::Vector3f::Constant(own);
    if (tint.squaredNorm() < 1e-4F * own * own) continue;  // grey tissue: white tells nothing
    const float amount = tint.dot(seen) / tint.squaredNorm();
    const float white = std::min(seen.sum() / 3 - std::max(0.F, amount) * own,
                                 std::max(0.F, (seen - kLeast * tissue).minCoeff()));
    const float over = std::clamp(white / (kNoise * own) - 1, 0.F, 1.F);
    for (Plane& plane : color) plane.values[k] = std::max(0.F, plane.values[k] - over * white);
  }
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
  lighting.finish = {.relief_slope = 0.1, .relief_mm = 1.5, .rim = 0.12};
  return lighting;
}

FrameAlbedo divide_light_out(const PreparedFrame& frame, const FrameDepth& depth,
                             const LaparoscopeOptions& options, double mm_per_unit) {
  const LitSurface lit =
      lit_surface(frame, depth, *laparoscope_lighting(options).scope, mm_per_unit);
  const Mask clear = clear_tissue(frame);
  FrameAlbedo albedo;
  albedo.reference_mm = mm_per_unit * median_range(lit, clear);
  LinearColor color = linear_color(frame.color);
  albedo.falloff_before = correlation(color, lit.falloff, clear);
  albedo.cosine_before = correlation(color, lit.cosine, clear);
  const double reference = albedo.reference_mm / mm_per_unit;
  const auto full = static_cast<float>(reference * reference);
  for (std::size_t k = 0; k < clear.size(); ++k) {
    const float light = full * lit.falloff.values[k] * lit.cosine.values[k];
    for (Plane& plane : color) plane.values[k] = light > 0 ? plane.values[k] / light : 0;
  }
  take_glow_out(frame, clear, color);
  for (Plane& plane : color) fill_outside(plane, clear);
  albedo.falloff_left = correlation(color, lit.falloff, clear);
  albedo.cosine_left = correlation(color, lit.cosine, clear);
  albedo.color = picture_of(color, frame.tissue);
  return albedo;
}

}  // namespace organbake
