// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "bench.h"
#include "measuring/baker.h"
#include "measuring/error_measures.h"
#include "measuring/noise_ct.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/volume/read_volume.h"

// What is left out gives the same bytes: that is for tests/acceptance. Here is what it saves.
namespace organbake {
namespace {
namespace fs = std::filesystem;

// One scene, worked through twice: everything, and without what may be left out.
struct SkipScene {
  std::string name;
  std::function<void()> whole, skipping;
  double faster = 1;  // so many times, at least
};

void save(Bench& bench, const SkipScene& scene) {
  bench.now(scene.name);
  const auto timings = bench.time({scene.whole, scene.skipping});
  bench.point(scene.name, "everything", timings[0]);
  bench.point(scene.name, "skipping", timings[1]);
  bench.at_least(scene.name + ": everything / skipping", "×",
                 timings[0].wall_ms.median / timings[1].wall_ms.median, scene.faster);
}

// Smaller ones take no longer than the programs take to start, which nothing can skip.
std::string skip_recipe(bool quick) {
  return organ_recipe(
      "what is skipped",
      quick ? "phantom: {photos: 2, photo_size_px: 64, size_voxels: [64, 64, 32]}\n"
              "place: {count: 6, size_px: 256}\nquality: draft\n"
            : "phantom: {photos: 8, photo_size_px: 512, size_voxels: [128, 128, 64]}\n"
              "place: {count: 6, size_px: 512}\n");
}

// Leaves a bundle in the folder "whole".
void skip_baking(Bench& bench) {
  const Baker baker(bench.scratch(), bench.context(), skip_recipe(bench.quick()));
  const fs::path whole = bench.scratch() / "whole", skipping = bench.scratch() / "skipping";
  baker.bake(skipping);
  save(bench, {"a recipe baked again", [&] { baker.bake(whole, {"--force"}); },
               [&] { baker.bake(skipping); }, 30});
  // Every round asks for a number of faces that the cache has not seen yet.
  int faces = 80;
  const auto with_faces = [&] { return "decimate.faces=" + std::to_string(faces); };
  save(bench, {"another number of faces",
               [&] {
                 baker.bake(whole, {"--force", "--set", with_faces()});
               },
               [&] {
                 faces += 2;  // a closed mesh has an even number
                 baker.bake(skipping, {"--set", with_faces()});
               }});
}

void skip_voxels(Bench& bench) {
  const fs::path file = bench.scratch() / "ct.mha";
  const Volume ct = write_noise_ct(file);
  for (const auto& [name, share] :
       {std::pair("slices in the middle of a CT", Eigen::Vector3d(1, 1, 0.18)),
        std::pair("a box in the middle of a CT", Eigen::Vector3d(0.7, 0.53, 0.45))}) {
    const Region region = middle_of(ct, share);
    save(bench, {name, [&] { read_volume(file, bench.context()); },
                 [&] { read_volume(file, {.region = region}, bench.context()); }});
  }
}

// Two frames of a camera that stands still: the same scene, other noise.
void skip_sweeps(Bench& bench) {
  LaparoscopyOptions options;
  options.frames = 2;
  if (bench.quick()) options.width = 320, options.height = 240;
  const LaparoscopyPhantom phantom(options);
  const LaparoscopyFrame frame = phantom.frame(0);
  const auto prepared = [&](std::uint64_t noise_seed) {
    return prepare_frame(with_noise(frame.image, noise_seed), frame.camera.intrinsics, {});
  };
  const PreparedFrame first = prepared(1), second = prepared(2);
  const FrameDepth previous = shade_frame(first, {});
  save(bench, {"a frame of a clip that stands still", [&] { shade_frame(second, {}); },
               [&] { shade_frame(second, {}, &previous); }});
}

// One of the vertices, pushed in by a little more for each frame.
std::vector<Eigen::Vector3d> pressed(const std::vector<Eigen::Vector3d>& rest, int frame) {
  std::vector<Eigen::Vector3d> positions = rest;
  positions[0] *= 1 - 0.002 * (frame + 1);
  return positions;
}

void skip_pixels(Bench& bench, const fs::path& folder) {
  const Bundle bundle = BundleReader(folder).read_all();
  const View view = orbit_view(bundle.cameras, {0.3, 0.1}, 1280, 720);
  const std::vector<Eigen::Vector3d>& rest = bundle.proxy.vertices;
  Warper whole_warper(bundle), warper(bundle);
  Frame whole, skipping;
  const auto anew = [&](const std::vector<Eigen::Vector3d>& positions) {
    whole.serial = 0;  // its last picture is not to be built on
    return whole_warper.draw(positions, view, {}, whole);
  };
  warper.draw(rest, view, {}, skipping);
  save(bench, {"an unchanged frame of 720p", [&] { anew(rest); },
               [&] { warper.draw(rest, view, {}, skipping); }, 30});
  int frame_of_whole = 0, frame_of_skipping = 0;
  save(bench,
       {"a frame of 720p with one vertex moved", [&] { anew(pressed(rest, frame_of_whole++)); },
        [&] { warper.draw(pressed(rest, frame_of_skipping++), view, {}, skipping); }});
  const DrawReport report = anew(rest);
  const double away = double(report.samples_facing_away);
  bench.at_least(
      "samples of the active cameras skipped in whole chunks, facing away", "%",
      100 * away / (away + double(report.samples_drawn) + double(report.samples_outside_view)), 0);
}

void run_skip(Bench& bench) {
  skip_baking(bench);
  skip_voxels(bench);
  skip_sweeps(bench);
  skip_pixels(bench, bench.scratch() / "whole");
}

const RegisteredPart kSkip(
    "skip", run_skip,
    "what a scene does not need: the time of everything against that of skipping");

}  // namespace
}  // namespace organbake
