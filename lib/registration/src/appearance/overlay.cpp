// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/registration/overlay.h"

#include <algorithm>
#include <array>

#include "appearance/appearance.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr int kMostSide = 1600;

Rgb8Image halved(const Rgb8Image& photo) {
  Rgb8Image half(photo.width / 2, photo.height / 2);
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x)
      for (int c = 0; c < 3; ++c)
        half.at(x, y)[c] = static_cast<std::uint8_t>(
            (photo.at(2 * x, 2 * y)[c] + photo.at(2 * x + 1, 2 * y)[c] +
             photo.at(2 * x, 2 * y + 1)[c] + photo.at(2 * x + 1, 2 * y + 1)[c] + 2) /
            4);
  return half;
}

std::array<std::uint8_t, 3> outline_color(Verdict verdict) {
  if (verdict == Verdict::ok) return {40, 230, 60};
  if (verdict == Verdict::doubtful) return {250, 220, 40};
  return {250, 50, 40};
}

bool on_outline(const Prediction& p, int x, int y) {
  const bool here = p.coverage[p.index(x, y)] >= 0.5f;
  for (const auto& [u, v] : {std::pair(x + 1, y), std::pair(x, y + 1), std::pair(x + 1, y + 1)}) {
    if (p.contains(u, v) && (p.coverage[p.index(u, v)] >= 0.5f) != here) return true;
  }
  return false;
}

// The light that explains the photograph best at the pose, so that both look alike where it fits.
Prediction lit_prediction(const RegisteredSurface& surface, const PhotoLevel& level,
                          const ObjectPose& pose, LightModel model,
                          const RegistrationOptions& options, double& offset) {
  Light light;
  light.model = model;
  light.toward = options.light_direction;
  const ShadingBasis basis(light, pose.center_camera_mm.norm());
  Prediction p;
  predict(surface, level, pose, 1, basis, basis.first_weights(), {}, p);
  std::vector<WeightedPixel> pixels = overlap(level, p, 3);
  if (pixels.empty()) return p;
  const Appearance appearance = fit_appearance(level, p, basis, pixels);
  relight(p, appearance.light);
  offset = appearance.offset;
  return p;
}

}  // namespace

Rgb8Image draw_overlay(const RegisteredSurface& surface, const Rgb8Image& photo,
                       const RegisteredPhoto& registered, const RegistrationOptions& options) {
  Rgb8Image image = photo;
  int factor = 1;
  while (std::max(image.width, image.height) > kMostSide) {
    image = halved(image);
    factor *= 2;
  }
  const ObjectPose pose = object_pose(registered.camera.camera_from_world, surface.center());
  if (!(pose.center_camera_mm.z() > 0)) return image;
  const std::vector<PhotoLevel> pyramid =
      photo_pyramid(image, {}, reduced(registered.camera.intrinsics, factor), kMostSide, kMostSide);
  if (pyramid.empty()) return image;
  double offset = 0;
  const Prediction p =
      lit_prediction(surface, pyramid.front(), pose, registered.light, options, offset);
  const int field = std::max(8, std::max(image.width, image.height) / 12);
  const auto color = outline_color(registered.quality.verdict);
  for (int y = p.top; y < p.top + p.height; ++y)
    for (int x = p.left; x < p.left + p.width; ++x) {
      const std::size_t i = p.index(x, y);
      const bool predicted = p.coverage[i] >= 0.5f && (x / field + y / field) % 2 == 0;
      const std::uint8_t grey = srgb8_from_linear(static_cast<float>(p.radiance[i] + offset));
      const bool edge = on_outline(p, x, y);
      for (int c = 0; c < 3; ++c) {
        if (predicted) image.at(x, y)[c] = grey;
        if (edge) image.at(x, y)[c] = color[c];
      }
    }
  return image;
}

}  // namespace organbake
