// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/relief_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "measuring/jpeg_loss.h"
#include "measuring/path_alignment.h"
#include "organbake/core/random.h"
#include "organbake/formats/camera_files.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/video_reader.h"
#include "peers/colmap.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr int kTruthEvery_px = 8;
constexpr double kTurn = 2 * std::numbers::pi;

std::vector<SeenPoint> sampled(const Plane& depth) {
  std::vector<SeenPoint> points;
  for (int y = kTruthEvery_px / 2; y < depth.height; y += kTruthEvery_px)
    for (int x = kTruthEvery_px / 2; x < depth.width; x += kTruthEvery_px)
      if (std::isfinite(depth.at(x, y))) points.push_back({{x + 0.5, y + 0.5}, depth.at(x, y)});
  return points;
}

// How a scene is seen, beside what it is.
LaparoscopyOptions seeded_view(std::uint64_t seed, RandomStream& random) {
  LaparoscopyOptions view;
  view.seed = seed;
  view.width = 480;
  view.height = 360;
  view.noise = random.uniform(0.001, 0.015);
  view.texture = random.uniform(0.03, 0.3);
  view.highlights = random.uniform(0.3, 1.2);
  view.instrument = random.uniform() < 0.3;
  view.round_view = random.uniform() < 0.5;
  view.two_tissues = random.uniform() < 0.7;
  view.beam_exponent = random.uniform() < 0.3 ? 0 : random.uniform(0, 6);
  view.light_offset_x_mm = random.uniform() < 0.5 ? 0 : random.uniform(-5, 5);
  return view;
}

LaparoscopyFrame frame_of_bed(LaparoscopyOptions view, RandomStream& random) {
  view.tilt_rad = random.uniform(-0.5, 0.5);
  return LaparoscopyPhantom(view).frame(static_cast<int>(random.below(8)));
}

LaparoscopyFrame frame_of_liver(const LaparoscopyOptions& view, RandomStream& random) {
  constexpr int kFrames = 24;
  MovingClipOptions clip{.view = view, .path = ScopePath::tour};
  clip.view.two_tissues = false;  // it has three by itself
  clip.view.frames = kFrames;
  clip.path = random.uniform() < 0.7 ? ScopePath::tour : ScopePath::approach;
  return MovingClip(clip).frame(static_cast<int>(random.below(kFrames)));
}

// Waves over the picture, some to the width: about 0, of standard deviation 1.
class Blotches {
 public:
  explicit Blotches(RandomStream& random) {
    for (Wave& wave : waves_) {
      const double angle = random.uniform(0, kTurn), count = random.uniform(0.8, 4);
      wave = {kTurn * count * std::cos(angle), kTurn * count * std::sin(angle),
              random.uniform(0, kTurn)};
    }
  }
  double at(double u, double v) const {
    double sum = 0;
    for (const Wave& wave : waves_) sum += std::sin(wave.by_u * u + wave.by_v * v + wave.phase);
    return sum / std::sqrt(0.5 * waves_.size());
  }

 private:
  struct Wave {
    double by_u, by_v, phase;
  };
  std::array<Wave, 6> waves_{};
};

// What real tissue has beyond the phantoms': pale tissue that is brighter than its hue says (the
// shared clip's brightness goes as (G/R)^1.7, the phantoms' as its square root to first power),
// organs mottled in greys that no hue tells, and a camera's own tone curve.
Rgb8Image made_harder(Rgb8Image image, RandomStream& random) {
  const double by_hue = random.uniform(0, 1), blotched = random.uniform(0, 0.5);
  const double tone = random.uniform(0.85, 1.2);
  const Blotches blotches(random);
  constexpr double kLeast = 1e-3;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      std::uint8_t* level = image.at(x, y);
      const double red = linear_from_srgb8()[level[0]], green = linear_from_srgb8()[level[1]];
      const double ratio = std::clamp((green + kLeast) / (red + kLeast), 0.1, 1.0);
      const double gain =
          std::pow(ratio, by_hue) *
          std::exp(blotched * blotches.at(double(x) / image.width, double(y) / image.width));
      for (int c = 0; c < 3; ++c)
        level[c] = srgb8_from_linear(static_cast<float>(
            std::min(1.0, std::pow(gain * linear_from_srgb8()[level[c]], tone))));
    }
  return image;
}

}  // namespace

ReliefScene seeded_relief_scene(std::uint64_t seed) {
  RandomStream random(seed, 59);
  const LaparoscopyOptions view = seeded_view(seed, random);
  LaparoscopyFrame frame = seed % 2 ? frame_of_liver(view, random) : frame_of_bed(view, random);
  ReliefScene scene;
  scene.name = (seed % 2 ? "liver " : "bed ") + std::to_string(seed);
  scene.camera = frame.camera.intrinsics;
  scene.truth = sampled(frame.depth_mm);
  const int quality = 40 + static_cast<int>(random.below(56));
  // Before the JPEG, as a camera would.
  scene.picture =
      through_jpeg(made_harder(std::move(frame.image), random), quality, ChromaSampling::halved);
  if (random.uniform() < 0.25) scene.shading.laparoscope.beam_exponent = view.beam_exponent;
  scene.shading.laparoscope.texture = random.uniform() < 0.5 ? 0.03 : 0.15;
  return scene;
}

std::vector<ReliefScene> clip_relief_scenes(const fs::path& video, const fs::path& model,
                                            std::size_t count) {
  constexpr int kCell_px = 8;
  const CameraSet cameras = read_camera_file(model);
  std::vector<Eigen::Vector3d> cloud;
  for (const ModelPoint& point : read_model_points(model)) cloud.push_back(point.place);
  std::vector<ReliefScene> scenes;
  VideoReader reader(video);
  StoredPicture picture;
  for (int number = 0; scenes.size() < count && reader.next(picture); ++number) {
    const std::size_t next = scenes.size() * (cameras.cameras.size() - 1) / (count - 1);
    if (frame_of_name(cameras.cameras[next].name) != number) continue;
    ReliefScene scene;
    scene.name = "clip " + std::to_string(number);
    scene.picture = picture;
    scene.camera = cameras.cameras[next].intrinsics;
    scene.frame.halvings = 1;
    scene.truth = nearest_points(cameras.cameras[next], cloud, kCell_px);
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

}  // namespace organbake
