// SPDX-License-Identifier: GPL-3.0-or-later
// What the light of a frame is: a distant one by statistics of the picture's levels and its first
// moments, before any surface is known; a lamp beside the lens, or its beam, from depth that is
// known; and the detail of a frame for colours that were found at a part of its size.
#include "light/light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/quantile.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/frame_albedo.h"
#include "organbake/shading/shape_from_shading.h"

namespace organbake {
namespace {

// The densest 2 % of the range of levels, and its mean.
struct Ground {
  double level = 0, width = 0;
};

Ground find_ground(const std::vector<float>& sorted) {
  const std::size_t n = sorted.size();
  const float span = 0.02F * (sorted.back() - sorted.front());
  Ground ground;
  std::size_t begin = 0, best = 0, best_begin = 0;
  for (std::size_t end = 0; end < n; ++end) {
    while (sorted[end] - sorted[begin] > span) ++begin;
    // Black is shadow, never a ground that is lit.
    if (sorted[begin] <= 0.01F * sorted.back()) continue;
    if (end + 1 - begin > best) {
      best = end + 1 - begin;
      best_begin = begin;
    }
  }
  if (best == 0) return {sorted[n / 2], span};
  ground.level = sorted[best_begin + best / 2];
  ground.width = span;
  return ground;
}

}  // namespace

LightEstimate estimate_light(const Plane& intensity, const Mask& inside) {
  LightEstimate estimate;
  std::vector<float> sorted;
  for (std::size_t k = 0; k < intensity.size(); ++k)
    if (inside.values[k] && std::isfinite(intensity.values[k]))
      sorted.push_back(intensity.values[k]);
  if (sorted.empty()) return estimate;
  std::sort(sorted.begin(), sorted.end());
  estimate.albedo = sorted[std::min(sorted.size() - 1, sorted.size() * 995 / 1000)];
  if (!(estimate.albedo > 0) || sorted.back() <= sorted.front()) return estimate;
  const Ground ground = find_ground(sorted);
  const double cosine = std::clamp(ground.level / estimate.albedo, 0.0, 1.0);
  estimate.light.slant_rad = std::acos(cosine);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::Zero();
  const auto relief = [&](std::size_t k) {
    return inside.values[k] && std::isfinite(intensity.values[k]) &&
           std::abs(intensity.values[k] - ground.level) > ground.width;
  };
  for (int y = 0; y < intensity.height; ++y)
    for (int x = 0; x < intensity.width; ++x)
      if (relief(intensity.index(x, y))) centre += Eigen::Vector3d(x, y, 1);
  if (centre.z() < 1) return estimate;
  centre /= centre.z();
  for (int y = 0; y < intensity.height; ++y)
    for (int x = 0; x < intensity.width; ++x) {
      const std::size_t k = intensity.index(x, y);
      if (!relief(k)) continue;
      const Eigen::Vector2d at(x - centre.x(), y - centre.y());
      direction += (intensity.values[k] - ground.level) * at;
    }
  if (direction.norm() <= 0) return estimate;
  estimate.light.tilt_rad = std::atan2(direction.y(), direction.x());
  return estimate;
}

// What a lamp beside the lens, or a beam, changes of the brightness under a lamp at the lens, pixel
// by pixel.

Plane light_ratio(const Plane& log_range_mm, const RayGrid& rays,
                  const LaparoscopeOptions& options) {
  const Eigen::Vector3d light(options.light_offset_x_mm, options.light_offset_y_mm, 0);
  Plane ratio(rays.width, rays.height, 1);
  for (int row = 0; row < rays.height; ++row)
    for (int column = 0; column < rays.width; ++column) {
      const Eigen::Vector3d ray = Eigen::Vector3d(rays.x(column), rays.y(row), 1).normalized();
      const Eigen::Vector3d point = std::exp(double(log_range_mm.at(column, row))) * ray;
      const Eigen::Vector3d toward = light - point;
      const double distance = toward.norm(), range = point.norm();
      double value = 1;
      if (!light.isZero() && distance > 1e-6) {
        const Eigen::Vector3d normal = normal_at(log_range_mm, rays, column, row);
        const double lit = std::max(0.0, normal.dot(toward)) / distance;
        const double central = std::max(0.02, -normal.dot(ray));
        value = lit / central * (range * range) / (distance * distance);
      }
      const double cosine = distance > 1e-6 ? -toward.z() / distance : 1;
      value *= std::pow(std::max(cosine, 1e-3), options.beam_exponent);
      ratio.at(column, row) = static_cast<float>(std::clamp(value, 0.05, 20.0));
    }
  return ratio;
}

LinearColor linear_color(const Rgb8Image& frame) {
  LinearColor linear;
  for (int c = 0; c < 3; ++c) {
    linear[c] = Plane(frame.width, frame.height);
    for (std::size_t k = 0; k < linear[c].size(); ++k)
      linear[c].values[k] = linear_from_srgb8()[frame.pixels[3 * k + c]];
  }
  return linear;
}

// A lamp's beam from frames whose depth is known: ln of brightness, less fall-off and cosine, is a
// line over ln cos of the angle to the axis, whose slope is the exponent. Sectors of the picture
// give it separately, and their scatter tells how far it is to be trusted.
namespace {

constexpr int kSectors = BeamRings::kSectors, kRings = BeamRings::kRings;
constexpr int kEvery_px = 2;  // along both sides
constexpr float kLeastConfidence = 0.3F;
constexpr double kLeastFacing = 0.4;       // cosine; where skin turns away normals matter too much
constexpr std::size_t kFewestPixels = 60;  // of a ring in a sector
constexpr int kFewestRings = 4, kFewestSectors = 5;

struct Pixel {
  float left, log_cosine;
};

// A line's slope by least squares through what one sector of all frames shows; each frame has a
// gain of its own. Nothing where the rings of no frame span enough.
std::optional<double> slope_of(const std::vector<BeamRings>& frames, int sector) {
  double xx = 0, xy = 0;
  for (const BeamRings& frame : frames) {
    double n = 0, x = 0, y = 0;
    const auto& left = frame.left[sector];
    const auto& log_cosine = frame.log_cosine[sector];
    for (int r = 0; r < kRings; ++r) {
      if (!std::isfinite(left[r])) continue;
      n += 1, x += log_cosine[r], y += left[r];
    }
    if (n < kFewestRings) continue;
    for (int r = 0; r < kRings; ++r) {
      if (!std::isfinite(left[r])) continue;
      const double off = log_cosine[r] - x / n;
      xx += off * off;
      xy += off * (left[r] - y / n);
    }
  }
  constexpr double kLeastSpread = 1e-4;  // of ln cosine, squared: about 8° against 14°
  if (xx < kLeastSpread) return std::nullopt;
  return xy / xx;
}

}  // namespace

bool BeamEstimate::told() const {
  constexpr double kMostSd = 0.75, kSignificant = 2;
  return sectors >= kFewestSectors && sd <= kMostSd && exponent > kSignificant * sd;
}

BeamRings beam_rings(const PreparedFrame& frame, const Plane& depth, const Plane& confidence) {
  const RayGrid rays = ray_grid(frame.camera);
  const std::vector<Eigen::Vector3f> normals =
      smooth_normals_from_depth(depth, rays, smooth_normals_radius_px(rays));
  const double corner = std::max({std::hypot(rays.x(0), rays.y(0)),
                                  std::hypot(rays.x(rays.width - 1), rays.y(rays.height - 1))});
  std::vector<Pixel> pixels[kSectors][kRings];
  for (int y = 0; y < rays.height; y += kEvery_px)
    for (int x = 0; x < rays.width; x += kEvery_px) {
      const std::size_t k = depth.index(x, y);
      if (!frame.diffuse.values[k] || confidence.values[k] < kLeastConfidence) continue;
      if (!std::isfinite(depth.values[k]) || !(frame.intensity.values[k] > 0)) continue;
      const double u = rays.x(x), v = rays.y(y), along2 = 1 + u * u + v * v;
      const double facing =
          -normals[k].cast<double>().dot(Eigen::Vector3d(u, v, 1)) / std::sqrt(along2);
      if (facing < kLeastFacing) continue;
      // ln I + 2 ln r − ln cos: the albedo and the beam.
      const double left = std::log(frame.intensity.values[k]) + 2 * std::log(depth.values[k]) +
                          std::log(along2) - std::log(facing);
      const double turn = (std::atan2(v, u) / std::numbers::pi + 1) / 2;
      const int sector = std::min(kSectors - 1, static_cast<int>(turn * kSectors));
      const int ring = std::min(kRings - 1, static_cast<int>(std::hypot(u, v) / corner * kRings));
      pixels[sector][ring].push_back(
          {static_cast<float>(left), static_cast<float>(-0.5 * std::log(along2))});
    }
  BeamRings found;
  for (int s = 0; s < kSectors; ++s)
    for (int r = 0; r < kRings; ++r) {
      found.left[s][r] = found.log_cosine[s][r] = std::numeric_limits<float>::quiet_NaN();
      const std::vector<Pixel>& of_ring = pixels[s][r];
      if (of_ring.size() < kFewestPixels) continue;
      std::vector<float> left;
      double log_cosine = 0;
      for (const Pixel& pixel : of_ring) {
        left.push_back(pixel.left);
        log_cosine += pixel.log_cosine;
      }
      found.left[s][r] = median(std::move(left));
      found.log_cosine[s][r] = static_cast<float>(log_cosine / double(of_ring.size()));
    }
  return found;
}

BeamEstimate estimate_beam(const std::vector<BeamRings>& frames) {
  std::vector<double> slopes;
  for (int s = 0; s < kSectors; ++s)
    if (const std::optional<double> slope = slope_of(frames, s)) slopes.push_back(*slope);
  BeamEstimate beam;
  if (slopes.size() < kFewestSectors) return beam;
  beam.sectors = static_cast<int>(slopes.size());
  const double count = static_cast<double>(slopes.size());
  double sum = 0, squares = 0;
  for (const double slope : slopes) sum += slope;
  beam.exponent = sum / count;
  for (const double slope : slopes) squares += (slope - beam.exponent) * (slope - beam.exponent);
  beam.sd = std::sqrt(squares / (count * (count - 1)));
  return beam;
}

// The detail of a frame for colours that were found at a part of its size: each pixel's share of
// what lies round it (a ratio image; Liu, Shan & Zhang 2001), in sRGB's encoding, where noise is
// about the same everywhere. It is added no louder than the frame itself has it: where a gain has
// turned the light up, noise is not turned up with it.
namespace {

// Pixels of means over blocks, as the frame's size has them; an odd last row or column, which fell
// away, is the one before it.
cv::Mat at_frame_size(const cv::Mat& reduced, cv::Size size, int halvings, int interpolation) {
  const cv::Size whole = reduced.size() * (1 << halvings);
  cv::Mat fine;
  cv::resize(reduced, fine, whole, 0, 0, interpolation);
  cv::copyMakeBorder(fine, fine, 0, std::max(0, size.height - whole.height), 0,
                     std::max(0, size.width - whole.width), cv::BORDER_REPLICATE);
  return fine(cv::Rect({0, 0}, size));
}

cv::Mat as_float(const Rgb8Image& picture) {
  cv::Mat values;
  cv_view(picture).convertTo(values, CV_32FC3);
  return values;
}

}  // namespace

Rgb8Image with_own_pixels(const Rgb8Image& color, const PreparedFrame& reduced,
                          const Rgb8Image& frame, int halvings) {
  if (color.width != reduced.color.width || color.height != reduced.color.height)
    throw BadDataError("the colours and the reduced frame are of different sizes");
  constexpr float kDark = 12, kLeast = 0.6F, kMost = 1.6F;  // of 255; of a pixel's surroundings
  const cv::Size size(frame.width, frame.height);
  const cv::Mat base = at_frame_size(as_float(color), size, halvings, cv::INTER_LINEAR);
  const cv::Mat around = at_frame_size(as_float(reduced.color), size, halvings, cv::INTER_LINEAR);
  cv::Mat weight;
  cv_view(reduced.diffuse).convertTo(weight, CV_32F);
  cv::min(weight, 1, weight);
  weight = at_frame_size(weight, size, halvings, cv::INTER_LINEAR);
  Rgb8Image fine(frame.width, frame.height);
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const float found = base.at<cv::Vec3f>(y, x)[c], seen = around.at<cv::Vec3f>(y, x)[c];
        const float detail =
            std::clamp((frame.at(x, y)[c] + kDark) / (seen + kDark), kLeast, kMost) - 1;
        const float loudness = std::min(1.F, (seen + kDark) / (found + kDark));
        const float value = found * (1 + weight.at<float>(y, x) * loudness * detail);
        fine.at(x, y)[c] = cv::saturate_cast<std::uint8_t>(value);
      }
  return fine;
}

}  // namespace organbake
