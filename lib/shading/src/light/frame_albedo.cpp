// SPDX-License-Identifier: GPL-3.0-or-later
// A frame divided by its light, as the shape that was found in it says, and without highlights.
#include "organbake/shading/frame_albedo.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "light/light.h"
#include "organbake/core/error.h"
#include "organbake/core/quantile.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"

namespace organbake {
namespace {

// Highlights and their glow are told from tissue by the dichromatic model (Shafer 1985): what is
// mirrored has the lamp's colour, the rest the tissue's own.

constexpr int kGlowShare = 24;  // of the longer side: how far a highlight's glow reaches

int share_of_side(const PreparedFrame& frame, int share) {
  return std::max(1, std::max(frame.color.width, frame.color.height) / share);
}

Eigen::Vector3f at(const LinearColor& color, std::size_t k) {
  return {color[0].values[k], color[1].values[k], color[2].values[k]};
}

// Pixels of which a camera cut so many channels off. Of two the hue is what was left of it. One
// alone, red, is cut off on much of what is pale, and a vessel there is still a vessel.
Mask clipped(const Rgb8Image& frame, int channels) {
  constexpr int kClipped = 245;
  Mask mask(frame.width, frame.height);
  for (std::size_t k = 0; k < mask.size(); ++k) {
    const std::uint8_t* level = &frame.pixels[3 * k];
    mask.values[k] =
        (level[0] >= kClipped) + (level[1] >= kClipped) + (level[2] >= kClipped) >= channels;
  }
  return mask;
}

// 1, or less where something dark, such as a vessel, shows through a broad sheen: brightness by the
// median round it. Among sparks, where the median is no sheen's, what is dark is a lens's or a
// codec's ring.
Plane dark_detail(const Rgb8Image& frame, int radius_px) {
  constexpr float kLeast = 0.6F, kNoSheen = 140, kSheen = 200;  // levels of 255
  constexpr int kWidest_px = 127;                               // half, of OpenCV's median of bytes
  Plane detail(frame.width, frame.height, 1);
  cv::Mat green(frame.height, frame.width, CV_8UC1), usual;
  for (std::size_t k = 0; k < detail.size(); ++k)
    green.data[k] = frame.pixels[3 * k + 1];  // in which blood is dark
  cv::medianBlur(green, usual, 2 * std::min(radius_px, kWidest_px) + 1);
  for (std::size_t k = 0; k < detail.size(); ++k) {
    const float around = linear_from_srgb8()[usual.data[k]];
    const float own = linear_from_srgb8()[green.data[k]];
    const float sheen =
        std::clamp((float(usual.data[k]) - kNoSheen) / (kSheen - kNoSheen), 0.F, 1.F);
    if (sheen > 0) detail.values[k] = 1 - sheen * (1 - std::clamp(own / around, kLeast, 1.F));
  }
  return detail;
}

// Colours as shares of their sum, filled from where `clear` says they are known and bright enough
// to be more than noise.
LinearColor chromaticity_around(const LinearColor& color, const Mask& clear, int smoothing_px) {
  const Mask everywhere(clear.width, clear.height, 1);
  LinearColor shares;
  Plane sum(clear.width, clear.height);
  for (int c = 0; c < 3; ++c) {
    shares[c] = box_mean(color[c], clear, smoothing_px);
    for (std::size_t k = 0; k < sum.size(); ++k) sum.values[k] += shares[c].values[k];
  }
  constexpr float kDark = 0.05F;  // of the median
  const float least = kDark * static_cast<float>(median_inside(sum, clear));
  Mask known = clear;
  for (std::size_t k = 0; k < sum.size(); ++k)
    known.values[k] = clear.values[k] && sum.values[k] > least;
  for (Plane& plane : shares) {
    for (std::size_t k = 0; k < sum.size(); ++k)
      if (known.values[k]) plane.values[k] /= sum.values[k];
    fill_outside(plane, known);
  }
  return shares;
}

// Round a highlight lies its glow, and tissue that mirrors a little. What is mirrored is white, and
// adds to the tissue's colour: with the colour of the tissue around, least squares over the three
// channels tell the two apart, and the texture stays.
void take_glow_out(const PreparedFrame& frame, const Mask& clear, const Mask& near,
                   LinearColor& color) {
  constexpr int kAroundShare = 40;  // of the longer side
  constexpr float kNoise = 0.05F;   // of the tissue's luminance: less white is no glow
  constexpr float kLeast = 0.75F;   // of the colour around: pale tissue is white by itself
  const int reach = share_of_side(frame, kGlowShare);
  const Mask free = without(clear, near);
  const Mask everywhere(clear.width, clear.height, 1);
  LinearColor around = color;
  for (Plane& plane : around) {
    fill_outside(plane, free);
    plane = box_mean(plane, everywhere, share_of_side(frame, kAroundShare));
  }
  // 1 beside the highlight, falling to 0 where its glow ends: no border of it may show.
  Plane fading(near.width, near.height);
  for (std::size_t k = 0; k < near.size(); ++k) fading.values[k] = near.values[k];
  fading = box_mean(box_mean(fading, everywhere, reach / 2), everywhere, reach / 4);
  for (std::size_t k = 0; k < clear.size(); ++k) {
    if (!clear.values[k] || !near.values[k]) continue;
    const Eigen::Vector3f tissue = at(around, k), seen = at(color, k);
    const float own = tissue.sum() / 3;
    const Eigen::Vector3f tint = tissue - Eigen::Vector3f::Constant(own);
    if (tint.squaredNorm() < 1e-4F * own * own) continue;  // grey tissue: white tells nothing
    const float amount = tint.dot(seen) / tint.squaredNorm();
    const float white = std::min(seen.sum() / 3 - std::max(0.F, amount) * own,
                                 std::max(0.F, (seen - kLeast * tissue).minCoeff()));
    const float over = std::clamp(white / (kNoise * own) - 1, 0.F, 1.F) *
                       std::clamp(2 * fading.values[k] - 1, 0.F, 1.F);
    for (Plane& plane : color) plane.values[k] = std::max(0.F, plane.values[k] - over * white);
  }
}

// Where a frame's own colour stands for tissue: neither on highlights nor on their rims, whose blue
// is the lens's, nor where a channel is clipped. Without any such pixel: the diffuse tissue.
Mask clear_tissue(const PreparedFrame& frame) {
  constexpr int kRimShare = 200;  // of the longer side
  Mask unclear = dilated(frame.highlights, std::max(1, share_of_side(frame, kRimShare)));
  const Mask cut_off = dilated(clipped(frame.color, 2), 1);
  for (std::size_t k = 0; k < unclear.size(); ++k) unclear.values[k] |= cut_off.values[k];
  const Mask clear = without(frame.diffuse, unclear);
  const bool any = std::any_of(clear.values.begin(), clear.values.end(),
                               [](std::uint8_t value) { return value != 0; });
  return any ? clear : frame.diffuse;
}

// Takes highlights and their glow out of a frame's colours, whose light may have been divided out
// already. Luminance and chromaticity are filled apart (push–pull over what is clear): a mixture of
// colours of unlike brightness would be of neither's hue.
void take_highlights_out(const PreparedFrame& frame, const Mask& clear, LinearColor& color) {
  constexpr int kHueShare = 160;    // of the longer side: hues are read over as many pixels
  constexpr int kDetailShare = 60;  // and what is dark is wider than no vessel
  const Mask near = dilated(frame.highlights, share_of_side(frame, kGlowShare));
  take_glow_out(frame, clear, near, color);
  const Mask cut_off = clipped(frame.color, 1);
  const LinearColor shares =
      chromaticity_around(color, without(clear, cut_off), share_of_side(frame, kHueShare));
  Plane sum = color[0];
  for (std::size_t k = 0; k < sum.size(); ++k) sum.values[k] = at(color, k).sum();
  fill_outside(sum, clear);
  const Plane detail = dark_detail(frame.color, share_of_side(frame, kDetailShare));
  for (std::size_t k = 0; k < sum.size(); ++k) {
    // White taken from what is cut off leaves another hue.
    const bool keeps_its_light = clear.values[k] != 0;
    if (keeps_its_light && !(cut_off.values[k] && near.values[k])) continue;
    const float all = std::max(1e-6F, at(shares, k).sum());
    const float bright = sum.values[k] * (keeps_its_light ? 1 : detail.values[k]);
    for (int c = 0; c < 3; ++c) color[c].values[k] = bright * shares[c].values[k] / all;
  }
}

// In sRGB's encoding a sensor's noise is about the same everywhere, and what a gain g makes of it
// is g^0.45 of it: that is what an eye sees, so noise is measured, quieted and limited there.

constexpr float kGamma = 2.2F;
constexpr float kSeen = 2.0F / 255;  // noise that an eye begins to see

// Of white noise the mean of 2×2 pixels has half; what a camera's scaling or a codec has made of it
// hangs together over several.
float noise_in_grains(const Plane& encoded, const Mask& counts) {
  ShadedImage image{encoded, Plane(counts.width, counts.height, 1), counts, {}};
  image.rays.width = counts.width, image.rays.height = counts.height;
  const ShadedImage half = halved(image);
  return static_cast<float>(
      std::max(noise_level(encoded, counts), 2 * noise_level(half.intensity, half.inside)));
}

// Of the encoded green, which of all channels is compressed least; of the darker half, too, whose
// gain a camera may have turned up.
float encoded_noise(const Rgb8Image& frame, const Plane& light, const Mask& counts) {
  Plane green(frame.width, frame.height);
  std::vector<float> lights;
  for (std::size_t k = 0; k < green.size(); ++k) {
    green.values[k] = static_cast<float>(frame.pixels[3 * k + 1]) / 255;
    if (counts.values[k] && light.values[k] > 0) lights.push_back(light.values[k]);
  }
  const float middle = median(std::move(lights));
  Mask dark = counts;
  for (std::size_t k = 0; k < dark.size(); ++k)
    dark.values[k] = counts.values[k] && light.values[k] > 0 && light.values[k] < middle;
  return std::max(noise_in_grains(green, counts), noise_in_grains(green, dark));
}

// Smooth but for edges of more than a few deviations of the noise (bilateral filter; Tomasi &
// Manduchi 1998).
cv::Mat quieted(const cv::Mat& encoded, float noise) {
  constexpr int kDiameter_px = 11;
  constexpr double kEdge = 3, kReach_px = 3;
  cv::Mat smooth;
  cv::bilateralFilter(encoded, smooth, kDiameter_px, kEdge * noise, kReach_px);
  return smooth;
}

// A frame's colours by the light that fell on each pixel (1 = as much as at the reference; 0 = no
// tissue, which becomes black), as far as the frame's noise allows: what a division makes louder is
// first quieted across edges of its own colour, and where noise would still be seen the division is
// damped to light / (light² + ε²), as Wiener's filter does. `counts`: pixels that noise is read
// from.
LinearColor divided_by_light(const Rgb8Image& frame, const Plane& light, const Mask& counts) {
  constexpr float kQuieted = 6;  // times less noise after the filter
  const float noise = encoded_noise(frame, light, counts);
  const float damping = std::pow(noise / (2 * kQuieted * kSeen), kGamma);
  cv::Mat encoded;
  cv_view(frame).convertTo(encoded, CV_32FC3, 1.0 / 255);
  const cv::Mat smooth = noise > 0 ? quieted(encoded, noise) : encoded;
  LinearColor color = linear_color(frame);
  for (int y = 0; y < light.height; ++y)
    for (int x = 0; x < light.width; ++x) {
      const std::size_t k = light.index(x, y);
      const float l = light.values[k];
      const float gain = l > 0 ? l / (l * l + damping * damping) : 0;
      // Of the noise's variance after the division what is seen: so much is drawn to the smooth.
      const float louder = noise * std::pow(gain, 1 / kGamma) / kSeen;
      const float share = louder > 1 ? 1 - 1 / (louder * louder) : 0;
      const auto& own = encoded.at<cv::Vec3f>(y, x);
      const auto& quiet = smooth.at<cv::Vec3f>(y, x);
      for (int c = 0; c < 3; ++c) {
        float& value = color[c].values[k];
        if (share > 0) value = linear_from_srgb(own[c] + share * (quiet[c] - own[c]));
        value *= gain;
      }
    }
  return color;
}

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

Lighting laparoscope_lighting(const LaparoscopeOptions& options, double known_share) {
  ScopeLight scope;
  scope.offset_mm = {options.light_offset_x_mm, options.light_offset_y_mm, 0};
  scope.beam_half_angle_rad =
      options.beam_exponent > 0 ? half_angle_of(options.beam_exponent) : kWidest_rad;
  Lighting lighting;
  lighting.ambient_above = lighting.ambient_below = Vector3d::Ones();  // colours are the albedo
  lighting.gloss = wet_gloss();
  // Where drops mirror the lamp follows from the shape: the less is known of it, the more sharply
  // they do, and so the fewer.
  constexpr double kFewest = 0.1;
  lighting.gloss.front().exponent /= std::clamp(known_share, kFewest, 1.0);
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
