// SPDX-License-Identifier: Apache-2.0
// In the order of a camera: light, which folds get less of, and focus, where a depth tells them;
// haze, what the sensor spreads, its curve, sharpening, noise, and the edge of the field.
#include "organbake/truth/scope_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "box_blur.h"
#include "depth_of_field.h"
#include "fold_shadows.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Channel = std::vector<float>;

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
  std::array<Channel, 3> light;

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
    Channel blown(light[0].size());
    for (std::size_t i = 0; i < blown.size(); ++i)
      blown[i] =
          kTimes * std::max(0.0f, std::min({light[0][i], light[1][i], light[2][i]}) - kBlown);
    const Channel spread = box_blurred(std::move(blown), width, height, std::max(1, width / 320));
    for (int c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < spread.size(); ++i)
        light[c][i] += static_cast<float>(scope.bloom) * kHue[c] * spread[i];
  }

  // To levels of 0…255.
  void encode() {
    for (Channel& channel : light)
      for (float& v : channel) v = level_of_light(v);
  }

  void sharpen() {
    if (!(scope.sharpening > 0)) return;
    Channel luma(light[0].size());
    for (std::size_t i = 0; i < luma.size(); ++i)
      luma[i] = luminance(light[0][i], light[1][i], light[2][i]);
    const Channel soft = box_blurred(luma, width, height, 1);
    for (Channel& channel : light)
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

}  // namespace organbake
