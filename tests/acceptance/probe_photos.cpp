// SPDX-License-Identifier: GPL-3.0-or-later

#include "organbake/registration/register_photo.h"
#include "organbake/shading/frame_depth.h"
#include "probes.h"
#include "support/testing.h"

namespace organbake {
namespace {

// Noise, one colour, a ramp, a lamp's spot, tissue with highlights, black with a few hot pixels.
Rgb8Image any_picture(RandomStream& random, int width, int height) {
  Rgb8Image image(width, height);
  const std::uint64_t kind = random.below(6);
  const double level = random.uniform(0, 255), noise = random.uniform(0, 20);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double dx = double(x) / width - 0.5, dy = double(y) / height - 0.5;
      double value = level;
      if (kind == 0) value = random.uniform(0, 255);
      if (kind == 2) value = 255 * (dx + 0.5);
      if (kind == 3) value = 255 / (1 + 8 * (dx * dx + dy * dy)) + noise * random.normal();
      if (kind == 4) value = chance(random, 0.02) ? 255 : 120 + noise * random.normal();
      if (kind == 5) value = chance(random, 0.01) ? 255 : 0;
      for (int c = 0; c < 3; ++c)
        image.at(x, y)[c] = std::uint8_t(std::clamp(value * (c == 0 ? 1 : 0.6), 0., 255.));
    }
  return image;
}

Intrinsics any_lens(RandomStream& random, int width, int height) {
  const double focal = width * any_size(random, -0.5, 1);
  Intrinsics lens{width,       height,      focal, focal * random.uniform(0.8, 1.2),
                  0.5 * width, 0.5 * height};
  if (chance(random, 0.2)) lens.k1 = random.uniform(-0.5, 0.5);
  if (chance(random, 0.05)) lens.fx = odd_number(random);
  if (chance(random, 0.02)) lens.width += 1;
  return lens;
}

double probe_shade(RandomStream& random) {
  const int width = 1 + int(random.below(64)), height = 1 + int(random.below(64));
  const Intrinsics lens = any_lens(random, width, height);
  const FrameOptions preparation{.halvings = int(random.below(3)),
                                 .masks = chance(random, 0.7),
                                 .piecewise_albedo = chance(random, 0.5)};
  ShadingOptions options;
  options.model = ShadingModel(random.below(2));
  options.laparoscope.texture = any_size(random, -4, 0);
  options.range_mm = chance(random, 0.5) ? 0 : any_size(random, -1, 4);
  if (chance(random, 0.2)) options.laparoscope.light_offset_x_mm = random.uniform(-20, 20);
  if (chance(random, 0.2)) options.laparoscope.beam_exponent = random.uniform(0, 8);
  if (chance(random, 0.05)) options.range_mm = odd_number(random);
  FrameDepth previous;
  double wrong = 0;
  for (int i = 0; i < 2; ++i) {
    const PreparedFrame frame =
        prepare_frame(any_picture(random, width, height), lens, preparation);
    FrameDepth result = shade_frame(frame, options, i > 0 ? &previous : nullptr);
    for (std::size_t k = 0; k < result.depth.size(); ++k) {
      if (!frame.tissue.values[k]) continue;
      expect_finite(double(result.depth.values[k]) + result.normals[k].sum(), "a depth");
      expect_finite(result.confidence.values[k], "a confidence");
      wrong += result.depth.values[k] <= 0;
    }
    previous = std::move(result);
  }
  return 2 * wrong;
}

// Pictures that show no organ: whatever pose comes out, it must not be called ok.
double probe_register(RandomStream& random) {
  const RegisteredSurface surface(chance(random, 0.8) ? sound_organ(random) : any_organ(random));
  const int size = 64;
  const PosedCamera camera = camera_round(random, surface.box(), size);
  PhotoToRegister photo;
  photo.image = any_picture(random, size, size);
  photo.intrinsics = chance(random, 0.9) ? camera.intrinsics : any_lens(random, size, size);
  photo.start = camera.camera_from_world;
  if (chance(random, 0.05)) photo.start->translation = any_point(random, 1000);
  RegistrationOptions options;
  options.light = LightModel(random.below(4));
  options.free_focal = chance(random, 0.2);
  options.finest_side_px = 64;
  const RegisteredPhoto found = register_photo(surface, photo, options);
  const RigidTransform& pose = found.camera.camera_from_world;
  expect_finite(pose.rotation.sum() + pose.translation.sum(), "a pose");
  expect_finite(found.quality.correlation, "a correlation");
  return found.quality.verdict == Verdict::ok ? 2 : 0;
}

}  // namespace

std::vector<Probe> photo_probes() {
  return {
      {"shade", "a depth that is not positive", probe_shade},
      {"register", "a wrong pose that is called ok", probe_register},
  };
}

}  // namespace organbake
