// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "organbake/bundle/bundle.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/core/text.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/frame_depth.h"
#include "suites.h"
#include "suites/skip_parts.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

std::string recipe(bool quick) {
  // Smaller ones take no longer than the programs take to start, which nothing can skip.
  const std::string scene = quick ? "photos: 2, photo_size: 64, size: [64, 64, 32]"
                                  : "photos: 8, photo_size: 512, size: [128, 128, 64]";
  return organ_recipe("what is skipped", "phantom: {" + scene + "}\nplace: {count: 6, size: " +
                                             (quick ? "256" : "512") + "}\n" +
                                             (quick ? "quality: draft\n" : ""));
}

double files_that_differ(const fs::path& a, const fs::path& b) {
  const auto files = list_files(a);
  if (files != list_files(b)) return double(files.size());
  double count = 0;
  for (const fs::path& file : files) {
    count += read_text_file(a / file) != read_text_file(b / file);
  }
  return count;
}

int stages_run(const nlohmann::ordered_json& bake) {
  int count = 0;
  for (const auto& stage : bake.at("stages")) count += stage.at("state") == "ran";
  return count;
}

// Texels that hold a piece of the organ.
double texels_in(const fs::path& bundle) {
  double count = 0;
  for (const CameraMaps& maps : BundleReader(bundle).read_all().maps) {
    for (const float depth : maps.depth_mm) count += std::isfinite(depth);
  }
  return count;
}

double cameras_in(const fs::path& bundle) {
  return double(BundleReader(bundle).read_frame().cameras.cameras.size());
}

// A viewer who never leaves a cone of 60°, and one who goes anywhere; each must be shown 99 % of
// what they can ever see by two cameras.
void skip_cameras(Bench& bench, const Baker& baker) {
  const fs::path all_round = bench.scratch() / "all round", cone = bench.scratch() / "cone";
  const std::vector<std::string> cover = {"--set", "place.coverage=0.99",
                                          "--set", "place.candidates=512",
                                          "--set", "place.samples=2048"};
  std::vector<std::string> inside = cover;
  inside.insert(inside.end(), {"--set", "place.cone_angle_deg=30"});
  bench.now("cameras for any view, and for a cone of 60°");
  baker.bake(all_round, cover);
  baker.bake(cone, inside);
  const auto saved = [](double whole, double part) { return 100 * (1 - part / whole); };
  using enum Figure::Goal;
  bench.add(Figure{"a viewing cone of 60°: cameras saved", "%",
                   saved(cameras_in(all_round), cameras_in(cone)), 40, at_least});
  bench.add(Figure{"a viewing cone of 60°: texels saved", "%",
                   saved(texels_in(all_round), texels_in(cone)), 40, at_least});
}

// Two frames of a camera that stands still: the same scene, other noise.
void skip_sweeps(Bench& bench) {
  LaparoscopyOptions options;
  options.frames = 2;
  if (bench.quick()) options.width = 320, options.height = 240;
  const auto frame_of = [&](std::uint64_t noise_seed) {
    LaparoscopyFrame truth = LaparoscopyPhantom(options).frame(0);
    RandomStream random(noise_seed);
    for (std::uint8_t& level : truth.image.pixels) {
      level = std::uint8_t(std::clamp(std::lround(level + random.normal()), 0L, 255L));
    }
    return prepare_frame(truth.image, truth.camera.intrinsics, {});
  };
  const PreparedFrame first = frame_of(1), second = frame_of(2);
  const FrameDepth previous = shade_frame(first, {});
  FrameDepth cold, warm;
  bench.now("a frame like the one before");
  const auto timings = bench.time(std::vector<std::function<void()>>{
      [&] { cold = shade_frame(second, {}); }, [&] { warm = shade_frame(second, {}, &previous); }});
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < cold.depth.size(); ++k) {
    if (!std::isfinite(cold.depth.values[k]) || !std::isfinite(warm.depth.values[k])) continue;
    sum += std::abs(warm.depth.values[k] / cold.depth.values[k] - 1);
    ++count;
  }
  const std::string task = "a frame of a clip that stands still";
  const double difference = 100 * sum / count;
  const auto add = [&](const char* subject, const Timing& timing, const FrameDepth& depth,
                       double error) {
    bench.add(Point{
        task,
        subject,
        false,
        {{"sweeps", "", double(depth.sweeps)}, {"refinements", "", double(depth.refinements)}},
        timing,
        {{"depth, mean difference to the cold start", "%", error}}});
  };
  add("everything", timings[0], cold, 0);
  add("skipping", timings[1], warm, difference);
  bench.add(Figure{task + ": mean difference to the cold start", "%", difference, 0.05});
  bench.add(
      Figure{task + ": warm / cold", "×", timings[1].cpu_ms.median / timings[0].cpu_ms.median, 1});
}

}  // namespace

double add_skip_scene(Bench& bench, const SkipScene& scene) {
  bench.now(scene.name);
  const auto timings = bench.time({scene.whole, scene.skipping});
  const double different = scene.different();
  const Quantity error{"results that differ", "", different};
  bench.add(Point{scene.name, "everything", false, {}, timings[0], {{error.name, "", 0}}});
  bench.add(Point{scene.name, "skipping", false, {}, timings[1], {error}});
  bench.add(Figure{scene.name + ": results that differ", "", different, 0});
  return timings[0].wall_ms.median / timings[1].wall_ms.median;
}

void skip_baking(Bench& bench, const Baker& baker) {
  using enum Figure::Goal;
  const fs::path whole = bench.scratch() / "whole", skipping = bench.scratch() / "skipping";
  baker.bake(skipping);
  const double again = add_skip_scene(
      bench, {"a recipe baked again", [&] { baker.bake(whole, {"--force"}); },
              [&] { baker.bake(skipping); }, [&] { return files_that_differ(whole, skipping); }});
  bench.add(Figure{"a recipe baked again: everything / skipping", "×", again, 30, at_least});

  // Every round asks for a number of faces that the cache has not seen yet.
  int faces = 80, stages = 0;
  const double option = add_skip_scene(
      bench, {"another number of faces",
              [&] {
                baker.bake(whole, {"--force", "--set", "decimate.faces=" + std::to_string(faces)});
              },
              [&] {
                faces += 2;  // a closed mesh has an even number
                stages = stages_run(
                    baker.bake(skipping, {"--set", "decimate.faces=" + std::to_string(faces)}));
              },
              [&] {
                baker.bake(whole, {"--force", "--set", "decimate.faces=" + std::to_string(faces)});
                return files_that_differ(whole, skipping);
              }});
  bench.add(Figure{"another number of faces: stages run, of 6", "", double(stages), 3});
  bench.add(Figure{"another number of faces: everything / skipping", "×", option, 1, at_least});
}

void run_skip_suite(Bench& bench) {
  const Baker baker(bench, recipe(bench.quick()));
  skip_baking(bench, baker);
  skip_cameras(bench, baker);
  skip_volume(bench);
  skip_sweeps(bench);
  const fs::path bundle = bench.scratch() / "whole";
  baker.bake(bundle);
  skip_frames(bench, bundle);
}

}  // namespace organbake
