// SPDX-License-Identifier: Apache-2.0
// What a scope's camera makes of a picture, in the order of a camera: light, which folds get less
// of, and focus, where a depth tells them; haze, what the sensor spreads, its curve, sharpening,
// noise, and the edge of the field.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/random.h"
#include "organbake/image/srgb.h"
#include "organbake/truth/lens_picture.h"

namespace organbake {
namespace {

// A window's mean along a row; beyond the ends is what lies there.
void box_row(const float* from, float* to, int width, int radius) {
  const auto at = [&](int x) { return from[std::clamp(x, 0, width - 1)]; };
  double sum = 0;
  for (int x = -radius; x <= radius; ++x) sum += at(x);
  for (int x = 0; x < width; ++x) {
    to[x] = static_cast<float>(sum / (2 * radius + 1));
    sum += at(x + radius + 1) - at(x - radius);
  }
}

// Down neighbouring columns, all of them at each row: alone each would load a cache line a value.
constexpr int kColumnsAtOnce = 64;

void box_columns(const float* from, float* to, int columns, int width, int height, int radius) {
  const auto row = [&](int y) { return from + std::size_t(std::clamp(y, 0, height - 1)) * width; };
  std::array<double, kColumnsAtOnce> sums = {};
  for (int y = -radius; y <= radius; ++y)
    for (int x = 0; x < columns; ++x) sums[x] += row(y)[x];
  for (int y = 0; y < height; ++y) {
    const float *const next = row(y + radius + 1), *const last = row(y - radius);
    float* const out = to + std::size_t(y) * width;
    for (int x = 0; x < columns; ++x) {
      out[x] = static_cast<float>(sums[x] / (2 * radius + 1));
      sums[x] += next[x] - last[x];
    }
  }
}

// One channel of a picture, row by row, under three boxes of 2 · radius + 1 pixels, each sum kept
// running: near enough to a Gaussian of about the radius. Beyond the border is what lies there.
std::vector<float> box_blurred(std::vector<float> channel, int width, int height, int radius) {
  constexpr int kBoxes = 3;
  std::vector<float> other(channel.size());
  for (int k = 0; k < kBoxes; ++k) {
    parallel_for(0, height, [&](int y) {
      const std::size_t row = std::size_t(y) * width;
      box_row(&channel[row], &other[row], width, radius);
    });
    parallel_for(0, (width + kColumnsAtOnce - 1) / kColumnsAtOnce, [&](int block) {
      const int x = block * kColumnsAtOnce;
      box_columns(&other[x], &channel[x], std::min(kColumnsAtOnce, width - x), width, height,
                  radius);
    });
  }
  return channel;
}

// Of blurred pictures: the boxes' radius, and the deviation of three of them.
struct Level {
  int radius_px;
  float deviation_px;
};
constexpr std::array<Level, 3> kLevels = {{{1, 1.41f}, {3, 3.46f}, {7, 7.48f}}};

// Of the middle third of the picture, each way; 0 where it shows nothing.
float focus_mm(const std::vector<float>& depth_mm, int width, int height) {
  std::vector<float> middle;
  for (int y = height / 3; y < height - height / 3; ++y)
    for (int x = width / 3; x < width - width / 3; ++x)
      if (const float z = depth_mm[std::size_t(y) * width + x]; std::isfinite(z))
        middle.push_back(z);
  return median(std::move(middle));
}

// Where a deviation lies between the levels: 0 is the sharp picture, 1 the first of them.
float level_of(float deviation_px) {
  float below = 0;
  for (std::size_t k = 0; k < kLevels.size(); ++k) {
    const float own = kLevels[k].deviation_px;
    if (deviation_px < own) return static_cast<float>(k) + (deviation_px - below) / (own - below);
    below = own;
  }
  return kLevels.size();
}

// `most`: how many of the blurred pictures take part.
void blur_channel(int channel, const std::vector<float>& levels, std::size_t most,
                  Rgb8Image& picture) {
  const auto& linear = linear_from_srgb8();
  std::array<std::vector<float>, kLevels.size() + 1> pictures;
  std::vector<float>& sharp = pictures[0];
  sharp.resize(levels.size());
  for (std::size_t i = 0; i < sharp.size(); ++i) sharp[i] = linear[picture.pixels[3 * i + channel]];
  for (std::size_t k = 0; k < most; ++k)
    pictures[k + 1] = box_blurred(sharp, picture.width, picture.height, kLevels[k].radius_px);
  parallel_for(0, picture.height, [&](int y) {
    for (std::size_t i = std::size_t(y) * picture.width, end = i + picture.width; i < end; ++i) {
      if (!(levels[i] > 0)) continue;
      const auto below = std::min(static_cast<std::size_t>(levels[i]), most - 1);
      const float share = levels[i] - static_cast<float>(below);
      picture.pixels[3 * i + channel] =
          srgb8_from_linear((1 - share) * pictures[below][i] + share * pictures[below + 1][i]);
    }
  });
}

}  // namespace

void blur_out_of_focus(double aperture_mm, double focal_px, const std::vector<float>& depth_mm,
                       Rgb8Image& picture) {
  constexpr float kDeviation = 0.25f, kSharp_px = 0.35f;  // of a disc's width; below is not seen
  if (!(aperture_mm > 0)) return;
  const float focus = focus_mm(depth_mm, picture.width, picture.height);
  if (!(focus > 0)) return;
  const auto disc = static_cast<float>(focal_px * aperture_mm);
  std::vector<float> levels(depth_mm.size());
  for (std::size_t i = 0; i < levels.size(); ++i)
    levels[i] = level_of(
        std::max(0.0f, kDeviation * disc * std::abs(1 / depth_mm[i] - 1 / focus) - kSharp_px));
  const float highest = *std::max_element(levels.begin(), levels.end());
  if (!(highest > 0)) return;
  const auto most = static_cast<std::size_t>(std::ceil(highest));
  for (int c = 0; c < 3; ++c) blur_channel(c, levels, most, picture);
}

// Ambient occlusion by the depth beside its own blurred picture (Luft, Colditz and Deussen 2006,
// "Image enhancement by unsharp masking the depth buffer"): a plane, however steep, is its own
// mean, so that nothing but folds and steps darken. Red comes back from the walls of a fold most.

namespace {

constexpr double kReach_mm = 3;                       // round a place, at the mean depth
constexpr float kDeep_mm = 1.5f;                      // where half of the strength is reached
constexpr float kApart_mm = 8;                        // beyond, two things are no longer near
constexpr std::array<float, 3> kHue = {0.75f, 1, 1};  // of the darkness, RGB

// 0…1, of a place that lies so much deeper than its surroundings.
float occluded(float deeper_mm) {
  if (!(deeper_mm > 0)) return 0;
  const float apart = deeper_mm / kApart_mm;
  return deeper_mm / (deeper_mm + kDeep_mm) / (1 + apart * apart * apart * apart);
}

}  // namespace

void darken_folds(double strength, double focal_px, const std::vector<float>& depth_mm,
                  Rgb8Image& picture) {
  if (!(strength > 0)) return;
  std::vector<float> there(depth_mm.size()), depth(depth_mm.size());
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (!std::isfinite(depth_mm[i])) continue;
    there[i] = 1, depth[i] = depth_mm[i];
    sum += depth_mm[i], ++count;
  }
  if (count == 0) return;
  constexpr int kMost_px = 64;
  const int radius = std::clamp(static_cast<int>(focal_px * kReach_mm * count / sum), 1, kMost_px);
  const std::vector<float> means =
      box_blurred(std::move(depth), picture.width, picture.height, radius);
  const std::vector<float> shares = box_blurred(there, picture.width, picture.height, radius);
  const auto& linear = linear_from_srgb8();
  parallel_for(0, picture.height, [&](int y) {
    for (int x = 0; x < picture.width; ++x) {
      const std::size_t i = std::size_t(y) * picture.width + x;
      if (!std::isfinite(depth_mm[i])) continue;
      const float dark =
          static_cast<float>(strength) * occluded(depth_mm[i] - means[i] / shares[i]);
      if (!(dark > 0.005f)) continue;
      std::uint8_t* const rgb = picture.at(x, y);
      for (int c = 0; c < 3; ++c) rgb[c] = srgb8_from_linear((1 - dark * kHue[c]) * linear[rgb[c]]);
    }
  });
}

namespace {

using ColorPlane = std::vector<float>;

std::uint32_t hashed(std::uint32_t h) {
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return h ^ (h >> 16);
}

// Of deviation 1, about: the sum of two even ones.
float noise(std::uint32_t seed, std::size_t at) {
  const std::uint32_t h = hashed(seed + static_cast<std::uint32_t>(at) * 0x9e3779b9u);
  return (static_cast<float>(h & 0xFFFFu) + static_cast<float>(h >> 16) - 65535.0f) / 26750.0f;
}

// Levels of 0…255 by straight lines between 4,096 places of the curve: within a hundredth of one.
float level_of_light(float linear) {
  constexpr int kSteps = 4096;
  static const std::vector<float> table = [] {
    std::vector<float> values(kSteps + 2);
    for (int i = 0; i <= kSteps; ++i)
      values[i] = 255 * srgb_from_linear(static_cast<float>(i) / kSteps);
    values[kSteps + 1] = values[kSteps];
    return values;
  }();
  const float place = kSteps * std::clamp(linear, 0.0f, 1.0f);
  const int step = static_cast<int>(place);
  return table[step] + (place - static_cast<float>(step)) * (table[step + 1] - table[step]);
}

struct Developing {
  const ScopePicture& scope;
  int width, height;
  std::array<ColorPlane, 3> light;

  Developing(const ScopePicture& of, const Rgb8Image& picture)
      : scope(of), width(picture.width), height(picture.height) {
    const auto& linear = linear_from_srgb8();
    const auto exposure = static_cast<float>(scope.exposure);
    for (int c = 0; c < 3; ++c) {
      light[c].resize(std::size_t(width) * height);
      for (std::size_t i = 0; i < light[c].size(); ++i)
        light[c][i] = exposure * linear[picture.pixels[3 * i + c]];
    }
  }

  // Smoke throws the scope's light back before it reaches the tissue.
  void add_haze() {
    constexpr std::array<float, 3> kSmoke = {0.17f, 0.16f, 0.17f};
    const auto share = static_cast<float>(scope.haze);
    for (int c = 0; c < 3 && share > 0; ++c)
      for (float& v : light[c]) v += share * (kSmoke[c] - v);
  }

  // What is blown was many times as bright: its spread shows round it, violet at the border.
  void add_bloom() {
    if (!(scope.bloom > 0)) return;
    constexpr float kBlown = 0.75f, kTimes = 4;
    constexpr std::array<float, 3> kHue = {0.75f, 0.7f, 1.1f};
    ColorPlane blown(light[0].size());
    for (std::size_t i = 0; i < blown.size(); ++i)
      blown[i] =
          kTimes * std::max(0.0f, std::min({light[0][i], light[1][i], light[2][i]}) - kBlown);
    const ColorPlane spread =
        box_blurred(std::move(blown), width, height, std::max(1, width / 320));
    for (int c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < spread.size(); ++i)
        light[c][i] += static_cast<float>(scope.bloom) * kHue[c] * spread[i];
  }

  // To levels of 0…255.
  void encode() {
    for (ColorPlane& channel : light)
      for (float& v : channel) v = level_of_light(v);
  }

  void sharpen() {
    if (!(scope.sharpening > 0)) return;
    ColorPlane luma(light[0].size());
    for (std::size_t i = 0; i < luma.size(); ++i)
      luma[i] = luminance(light[0][i], light[1][i], light[2][i]);
    const ColorPlane soft = box_blurred(luma, width, height, 1);
    for (ColorPlane& channel : light)
      for (std::size_t i = 0; i < luma.size(); ++i)
        channel[i] += static_cast<float>(scope.sharpening) * (luma[i] - soft[i]);
  }

  // More in the dark parts than in the bright ones, half of it in the hue.
  void add_grain(std::uint32_t seed) {
    if (!(scope.grain > 0)) return;
    for (std::size_t i = 0; i < light[0].size(); ++i) {
      const float grey = noise(seed, i);
      for (int c = 0; c < 3; ++c) {
        float& v = light[c][i];
        const float dark = 1.3f - std::clamp(v / 255, 0.0f, 1.0f);
        v += static_cast<float>(scope.grain) * dark *
             (0.8f * grey + 0.5f * noise(seed + 77u * (c + 1), i));
      }
    }
  }

  // The field's edge is as sharp as the optics: some pixels.
  float field_share(int x, int y) const {
    if (!(scope.field > 0)) return 1;
    constexpr double kEdge_px = 1.5;
    const double radius = 0.5 * scope.field * width;
    const double away = std::hypot(x + 0.5 - 0.5 * width, y + 0.5 - 0.5 * height);
    return static_cast<float>(std::clamp(0.5 + (radius - away) / (2 * kEdge_px), 0.0, 1.0));
  }

  void write(Rgb8Image& picture) const {
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const std::size_t i = std::size_t(y) * width + x;
        const float share = field_share(x, y);
        for (int c = 0; c < 3; ++c)
          picture.pixels[3 * i + c] =
              static_cast<std::uint8_t>(std::clamp(share * light[c][i], 0.0f, 255.0f) + 0.5f);
      }
  }
};

}  // namespace

void apply_scope_picture(const ScopePicture& scope, Rgb8Image& picture) {
  if (scope.off() || picture.pixels.empty()) return;
  std::uint32_t seed = 1;
  for (const std::uint8_t v : picture.pixels) seed = seed * 31 + v;
  Developing developing(scope, picture);
  developing.add_haze();
  developing.add_bloom();
  developing.encode();
  developing.sharpen();
  developing.add_grain(seed);
  developing.write(picture);
}

void apply_scope_picture(const ScopePicture& scope, double focal_px,
                         const std::vector<float>& depth_mm, Rgb8Image& picture) {
  darken_folds(scope.folds, focal_px, depth_mm, picture);
  blur_out_of_focus(scope.aperture_mm, focal_px, depth_mm, picture);
  apply_scope_picture(scope, picture);
}

namespace {

// Quantiles of the normal distribution: quick, and the same everywhere.
constexpr int kQuantileBits = 12;
const std::array<float, 1 << kQuantileBits>& normal_quantiles() {
  static const auto table = [] {
    std::array<float, 1 << kQuantileBits> quantiles{};
    // By bisection of the distribution function.
    for (std::size_t i = 0; i < quantiles.size(); ++i) {
      const double share = (double(i) + 0.5) / double(quantiles.size());
      double low = -6, high = 6;
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        (0.5 * std::erfc(-middle / std::numbers::sqrt2) < share ? low : high) = middle;
      }
      quantiles[i] = static_cast<float>(0.5 * (low + high));
    }
    return quantiles;
  }();
  return table;
}

void add_noise(double deviation, RandomStream random, Rgb8Image& picture) {
  const auto& quantiles = normal_quantiles();
  const auto scale = static_cast<float>(deviation);
  constexpr int kAtOnce = 64 / kQuantileBits;
  std::uint64_t bits = 0;
  int left = 0;
  for (std::uint8_t& value : picture.pixels) {
    if (left == 0) bits = random(), left = kAtOnce;
    const float noisy = static_cast<float>(value) + scale * quantiles[bits % quantiles.size()];
    bits >>= kQuantileBits, --left;
    value = static_cast<std::uint8_t>(std::clamp(noisy + 0.5f, 0.0f, 255.0f));
  }
}

}  // namespace

void expose(double gain, double noise, std::uint64_t seed, std::uint64_t item, Rgb8Image& picture) {
  if (gain != 1) {
    std::array<std::uint8_t, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i)
      table[i] = srgb8_from_linear(static_cast<float>(gain) * linear_from_srgb8()[i]);
    for (std::uint8_t& value : picture.pixels) value = table[value];
  }
  if (noise > 0) add_noise(noise, RandomStream(seed ^ 0x6e6f697365ull, item), picture);
}

}  // namespace organbake
