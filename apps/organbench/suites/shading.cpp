// SPDX-License-Identifier: GPL-3.0-or-later
// Frames to depth: surfaces of known formula under a lamp at the lens, clean and noisy, against a
// flat plane and brightness taken for range; and frames a second of clips and of pairs of eyes.
#include <algorithm>
#include <cmath>
#include <string>

#include "bench.h"
#include "measuring/agreement.h"
#include "measuring/scenes.h"
#include "organbake/core/text.h"
#include "organbake/phantom/known_answers.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/shape_from_shading.h"

namespace organbake {
namespace {

constexpr const char* kRangeError = "relative depth error, mean, one scale fitted";

Plane flat_log_range(const Intrinsics& camera) {
  const RayGrid rays = ray_grid(camera);
  Plane v(camera.width, camera.height);
  for (int y = 0; y < v.height; ++y)
    for (int x = 0; x < v.width; ++x)
      v.at(x, y) =
          static_cast<float>(0.5 * std::log1p(std::pow(rays.x(x), 2) + std::pow(rays.y(y), 2)));
  return v;
}

// r ∝ 1/√I: what is dark is far.
Plane brightness_log_range(const Plane& intensity) {
  Plane logs = intensity;
  for (float& value : logs.values) value = std::log(std::max(value, 2e-3F));
  return farthest_log_range(logs);
}

NearScene noisy_scene(double amplitude, int size, double noise, std::uint64_t seed) {
  NearScene scene = near_scene(amplitude, size);
  if (noise > 0) add_noise(scene.intensity, noise, seed);
  return scene;
}

RangeEstimate estimated(const NearScene& scene, const RangeEstimate* previous = nullptr) {
  const Mask inside(scene.camera.width, scene.camera.height, 1);
  return shade_laparoscope(scene.intensity, inside, scene.camera, {}, previous);
}

// The same surface seen by every method; the error of ours.
double near_case(Bench& bench, double amplitude, int size, double noise) {
  const NearScene scene = noisy_scene(amplitude, size, noise, 1);
  const std::string task =
      "laparoscope light, A = " + to_text(amplitude) +
      (noise > 0 ? ", 8 bit + " + to_text(100 * noise) + " % noise" : ", clean");
  const Timing timing = bench.time([&] { estimated(scene); });
  const Quantities knobs = {{"side", "px", double(size)}};
  const auto add = [&](const char* subject, bool peer, const Timing& taken, const Plane& v) {
    const double error = range_error_percent(v, scene.log_range);
    bench.add(Point{task, subject, peer, knobs, taken, {{kRangeError, "%", error}}});
    return error;
  };
  add("flat plane", true, {}, flat_log_range(scene.camera));
  add("brightness as range", true, {}, brightness_log_range(scene.intensity));
  return add("organbake", false, timing, estimated(scene).log_range);
}

void near_light(Bench& bench) {
  const std::vector<int> sizes = bench.quick() ? std::vector{128} : std::vector{128, 256, 512};
  const auto amplitudes = bench.quick() ? std::vector{0.25, 1.0} : std::vector{0.25, 0.5, 1.0};
  for (const auto& [noise, target] :
       {std::pair{0.0, 0.25}, std::pair{0.01, 0.5}, std::pair{0.03, 1.0}}) {
    double sum = 0, worst = 0;
    int count = 0;
    for (double amplitude : amplitudes)
      for (int size : sizes) {
        bench.now("laparoscope light, noise " + to_text(noise));
        const double error = near_case(bench, amplitude, size, noise);
        sum += error;
        worst = std::max(worst, error);
        ++count;
      }
    const std::string what = noise > 0 ? "8 bit + " + to_text(100 * noise) + " % noise" : "clean";
    bench.at_most("laparoscope light, " + what + ": mean over surfaces and sizes", "%", sum / count,
                  target);
    bench.at_most("laparoscope light, " + what + ": the worst case", "%", worst, target);
  }
}

void near_light_times(Bench& bench) {
  if (bench.quick()) return;
  bench.now("one frame of 512×512");
  // The surface has moved meanwhile: of one that stands still the depth would be taken over.
  const NearScene first = noisy_scene(0.5, 512, 0.01, 1), second = noisy_scene(0.52, 512, 0.01, 2);
  const RangeEstimate previous = estimated(first);
  const auto timings = bench.time(std::vector<std::function<void()>>{
      [&] { estimated(second); }, [&] { estimated(second, &previous); }});
  bench.at_most("512² frame, one thread, cold: CPU", "ms", timings[0].cpu_ms.median, 250);
  bench.at_most("512² frame, one thread, from the previous frame: CPU", "ms",
                timings[1].cpu_ms.median, 80);
}

// Decoding, masks and shading; what the stage writes is measured by running the stage.
void real_clip(Bench& bench) {
  const std::filesystem::path path = bench.data("video/laparoscopy_720p_25fps.mp4");
  if (path.empty()) return;
  bench.now("real clip");
  const int most = bench.count(8, 25);
  int frames = 0;
  const Timing timing = bench.time([&] {
    VideoReader reader(path);
    StoredPicture image;
    FrameDepth previous;
    for (frames = 0; frames < most && reader.next(image); ++frames) {
      const PreparedFrame frame = prepare_frame(
          image, assumed_camera(image.color.width, image.color.height, 1.22), {.halvings = 1});
      previous = shade_frame(frame, {}, frames > 0 ? &previous : nullptr);
    }
  });
  bench.at_least("real clip at half size, one thread, without writing: rate", "frames/s",
                 1000.0 * frames / timing.wall_ms.median, 5);
  bench.at_most("real clip: memory", "MB", timing.peak_mb, 400);
}

void stereo_rates(Bench& bench) {
  for (const auto& [width, height, target] :
       {std::tuple{720, 576, 5.0}, std::tuple{1280, 720, 2.0}}) {
    const std::string size = std::to_string(width) + "x" + std::to_string(height);
    bench.now("stereo, " + size);
    const EyePair pair(width, height, 1);
    const Timing timing = bench.time([&] { pair.matched(); });
    bench.at_least("stereo, " + size + ", without reading and writing: rate", "frames/s",
                   1000 / timing.wall_ms.median, target);
    bench.at_most("stereo, " + size + ": memory", "MB", timing.peak_mb, 600);
  }
}

void run_shading(Bench& bench) {
  near_light(bench);
  near_light_times(bench);
  real_clip(bench);
  stereo_rates(bench);
}

const RegisteredPart kShading(
    "shading", run_shading,
    "frames to depth: surfaces, noise and lights against truth, clips and eyes a second");

}  // namespace
}  // namespace organbake
