// SPDX-License-Identifier: Apache-2.0
#include "clip.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/image/srgb.h"
#include "organbake/player/script_camera.h"
#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

const Bundle& organ_of_clips() {
  static const Bundle bundle = [] {
    SyntheticOptions options;
    options.map_size = 32;
    options.base_step_mm = 12;
    return make_synthetic_bundle(options);
  }();
  return bundle;
}

DatasetSpec spec_of_clips() {
  DatasetSpec spec;
  spec.cone_rad = 0.4;
  spec.distance = {0.9, 1.1};
  spec.motion_rad = 0.05;
  spec.fewest_pokes = 1, spec.most_pokes = 3;
  spec.gain = {0.5, 2};
  spec.noise = {1, 4};
  return spec;
}

TEST(Clip, StaysWithinItsSpec) {
  const Bundle& bundle = organ_of_clips();
  const DatasetSpec spec = spec_of_clips();
  const Eigen::Vector3d center = bundle.cameras.manifold.center_world_mm,
                        eye = bundle.cameras.cameras[0].center_world_mm();
  double widest = 0;
  for (int i = 0; i < 200; ++i) {
    const DatasetClip clip = make_clip(spec, bundle, 2, i);
    const View first = view_at(clip.script, 0, bundle.cameras, 64, 48),
               last = view_at(clip.script, spec.clip_frames - 1, bundle.cameras, 64, 48);
    const Eigen::Vector3d from = first.camera.center_world_mm() - center,
                          to = last.camera.center_world_mm() - center;
    const auto angle = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      return std::acos(std::min(1.0, a.normalized().dot(b.normalized())));
    };
    EXPECT_LE(angle(from, eye - center), spec.cone_rad + 1e-9);
    EXPECT_LE(angle(from, to), spec.motion_rad + 1e-7);
    widest = std::max(widest, angle(from, eye - center));
    const double distance = from.norm() / (eye - center).norm();
    EXPECT_GE(distance, 0.9 - 1e-9);
    EXPECT_LE(distance, 1.1 + 1e-9);
    EXPECT_GE(clip.script.instruments.size(), 1u);
    EXPECT_LE(clip.script.instruments.size(), 3u);
    EXPECT_GE(clip.gain, 0.5);
    EXPECT_LE(clip.noise, 4);
  }
  EXPECT_GT(widest, 0.9 * spec.cone_rad);
}

TEST(Clip, FollowsFromSeedOrganAndNumberAlone) {
  const auto text = [](std::uint64_t seed, std::size_t organ, int number) {
    DatasetSpec spec = spec_of_clips();
    spec.seed = seed;
    return script_to_json(make_clip(spec, organ_of_clips(), organ, number).script);
  };
  EXPECT_EQ(text(1, 0, 5), text(1, 0, 5));
  EXPECT_NE(text(1, 0, 5), text(2, 0, 5));
  EXPECT_NE(text(1, 0, 5), text(1, 1, 5));
  EXPECT_NE(text(1, 0, 5), text(1, 0, 6));
}

TEST(Expose, AddsNoiseOfTheDeviationThatWasAsked) {
  Rgb8Image grey(200, 100);
  std::fill(grey.pixels.begin(), grey.pixels.end(), std::uint8_t{120});
  Rgb8Image noisy = grey, other = grey, again = grey;
  expose(1, 5, 1, 7, noisy);
  expose(1, 5, 1, 8, other);
  expose(1, 5, 1, 7, again);
  EXPECT_EQ(noisy.pixels, again.pixels);
  EXPECT_NE(noisy.pixels, other.pixels);
  double sum = 0, squares = 0;
  for (const std::uint8_t value : noisy.pixels) sum += value, squares += double(value) * value;
  const double n = double(noisy.pixels.size()), mean = sum / n;
  // 60,000 values: the mean is good to 0.02, the deviation to 0.015; three times that, and the
  // rounding's own twelfth.
  EXPECT_NEAR(mean, 120, 0.06);
  EXPECT_NEAR(std::sqrt(squares / n - mean * mean), std::sqrt(25 + 1.0 / 12), 0.05);
}

TEST(Expose, ScalesLinearLight) {
  Rgb8Image picture(1, 1);
  picture.pixels = {100, 200, 255};
  expose(0.5, 0, 1, 0, picture);
  EXPECT_EQ(picture.pixels[0], srgb8_from_linear(0.5f * linear_from_srgb8()[100]));
  EXPECT_EQ(picture.pixels[2], srgb8_from_linear(0.5f));
  const Rgb8Image before = picture;
  expose(1, 0, 1, 0, picture);
  EXPECT_EQ(picture.pixels, before.pixels);
}

}  // namespace
}  // namespace organbake
