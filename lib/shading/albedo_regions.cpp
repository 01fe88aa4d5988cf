// SPDX-License-Identifier: GPL-3.0-or-later
#include "shading/albedo_regions.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/median.h"
#include "image/srgb.h"
#include "shading/box_mean.h"
#include "shading/every_second.h"

namespace organbake {
namespace {

constexpr double kSameColour = 0.03;  // chromaticities nearer than this are one tissue

// Red and green shares of the smoothed linear colour.
struct Chromaticity {
  Plane red, green;

  Chromaticity(const Rgb8Image& frame, const Mask& inside) {
    Plane linear[3];
    for (int c = 0; c < 3; ++c) {
      Plane plane(frame.width, frame.height);
      for (std::size_t k = 0; k < plane.size(); ++k)
        plane.values[k] = linear_from_srgb8()[frame.pixels[3 * k + c]];
      linear[c] = box_mean(plane, inside, std::max(1, frame.width / 160));
    }
    red = green = Plane(frame.width, frame.height);
    for (std::size_t k = 0; k < red.size(); ++k) {
      const float sum = linear[0].values[k] + linear[1].values[k] + linear[2].values[k] + 1e-6F;
      red.values[k] = linear[0].values[k] / sum;
      green.values[k] = linear[1].values[k] / sum;
    }
  }
  Eigen::Vector2d at(std::size_t k) const { return {red.values[k], green.values[k]}; }
};

int nearest(const std::vector<Eigen::Vector2d>& centres, const Eigen::Vector2d& at) {
  int best = 0;
  for (int i = 1; i < static_cast<int>(centres.size()); ++i)
    if ((centres[i] - at).squaredNorm() < (centres[best] - at).squaredNorm()) best = i;
  return best;
}

// Seeds along the line of the red share, from its least to its largest tenth.
std::vector<Eigen::Vector2d> cluster(const Chromaticity& colour, const Mask& inside, int most) {
  std::vector<float> reds;
  const std::size_t stride = 1 + inside.size() / 20000;
  for (std::size_t k = 0; k < inside.size(); k += stride)
    if (inside.values[k]) reds.push_back(colour.red.values[k]);
  std::vector<Eigen::Vector2d> centres;
  if (reds.empty()) return centres;
  std::sort(reds.begin(), reds.end());
  for (int i = 0; i < most; ++i) {
    const double share = 0.1 + 0.8 * (i + 0.5) / most;
    const double red = reds[static_cast<std::size_t>(share * (reds.size() - 1))];
    centres.emplace_back(red, (1 - red) / 2);
  }
  for (int step = 0; step < 10; ++step) {
    std::vector<Eigen::Vector3d> sums(centres.size(), Eigen::Vector3d::Zero());
    for (std::size_t k = 0; k < inside.size(); k += stride)
      if (inside.values[k]) {
        const Eigen::Vector2d at = colour.at(k);
        sums[nearest(centres, at)] += Eigen::Vector3d(at.x(), at.y(), 1);
      }
    for (std::size_t i = 0; i < centres.size(); ++i)
      if (sums[i].z() > 0) centres[i] = sums[i].head<2>() / sums[i].z();
  }
  std::vector<Eigen::Vector2d> apart;
  for (const Eigen::Vector2d& centre : centres) {
    const bool known = std::any_of(apart.begin(), apart.end(), [&](const Eigen::Vector2d& other) {
      return (other - centre).norm() < kSameColour;
    });
    if (!known) apart.push_back(centre);
  }
  return apart;
}

// ln(brightness of b / brightness of a) across all places where the two meet, its median.
bool border_ratio(const AlbedoRegions& regions, const Plane& intensity, const Mask& inside, int a,
                  int b, double& log_ratio) {
  const int reach = std::max(2, intensity.width / 80);
  std::vector<float> logs;
  const auto compare = [&](int x0, int y0, int x1, int y1) {
    if (x1 >= intensity.width || y1 >= intensity.height) return;
    if (!inside.at(x0, y0) || !inside.at(x1, y1)) return;
    const int i = regions.region.at(x0, y0), j = regions.region.at(x1, y1);
    if (!((i == a && j == b) || (i == b && j == a))) return;
    const float one = intensity.at(x0, y0), other = intensity.at(x1, y1);
    if (one <= 0 || other <= 0) return;
    logs.push_back(i == a ? std::log(other / one) : std::log(one / other));
  };
  for (int y = 0; y < intensity.height; y += 2)
    for (int x = 0; x < intensity.width; x += 2) {
      compare(x, y, x + reach, y);
      compare(x, y, x, y + reach);
    }
  constexpr std::size_t kFewest = 50;
  if (logs.size() < kFewest) return false;
  log_ratio = median(std::move(logs));
  return true;
}

}  // namespace

AlbedoRegions find_albedo_regions(const Rgb8Image& frame, const Plane& intensity,
                                  const Mask& inside, int most) {
  // Tissues are large: half the resolution tells them apart as well, in a quarter of the time.
  constexpr int kEnough = 400;
  if (frame.width > kEnough) {
    AlbedoRegions half = find_albedo_regions(every_second(frame), every_second(intensity),
                                             every_second(inside), most);
    half.region = expanded(half.region, inside);
    return half;
  }
  AlbedoRegions regions;
  regions.region = Mask(frame.width, frame.height);
  const Chromaticity colour(frame, inside);
  const std::vector<Eigen::Vector2d> centres = cluster(colour, inside, most);
  regions.albedo.assign(std::max<std::size_t>(1, centres.size()), 1.0);
  if (centres.size() < 2) return regions;
  std::vector<std::size_t> sizes(centres.size());
  for (std::size_t k = 0; k < inside.size(); ++k) {
    if (!inside.values[k]) continue;
    const int index = nearest(centres, colour.at(k));
    regions.region.values[k] = static_cast<std::uint8_t>(index);
    ++sizes[static_cast<std::size_t>(index)];
  }
  const int base = static_cast<int>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  for (int i = 0; i < static_cast<int>(centres.size()); ++i) {
    double log_ratio = 0;
    if (i != base && border_ratio(regions, intensity, inside, base, i, log_ratio))
      regions.albedo[static_cast<std::size_t>(i)] = std::exp(std::clamp(log_ratio, -1.5, 1.5));
  }
  return regions;
}

void normalise_albedo(const AlbedoRegions& regions, Plane& intensity) {
  for (std::size_t k = 0; k < intensity.size(); ++k)
    intensity.values[k] /= static_cast<float>(regions.albedo[regions.region.values[k]]);
}

}  // namespace organbake
