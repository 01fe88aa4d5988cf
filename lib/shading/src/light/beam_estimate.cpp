// SPDX-License-Identifier: GPL-3.0-or-later
// A lamp's beam from frames whose depth is known: ln of brightness, less fall-off and cosine, is a
// line over ln cos of the angle to the axis, whose slope is the exponent. Sectors of the picture
// give it separately, and their scatter tells how far it is to be trusted.
#include "organbake/shading/beam_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "organbake/core/median.h"
#include "organbake/shading/depth_maps.h"

namespace organbake {
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

}  // namespace organbake
