// SPDX-License-Identifier: GPL-3.0-or-later
// How long a capture takes, from the surface to maps on the disk, beside Embree's rays and
// OpenEXR's packing alone; and how large the files of photographs' colours are, exact and compact.
#include "organbake/capture/capture.h"

#include <cmath>

#include "bench.h"
#include "measuring/agreement.h"
#include "organbake/bundle/stored_maps.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/decimate/decimate.h"
#include "organbake/geometry/shell.h"
#include "organbake/phantom/phantom.h"
#include "organbake/viewpoints/placement.h"
#include "peers/peers.h"

namespace organbake {
namespace fs = std::filesystem;

namespace {

// The phantom organ, coloured, its proxy, and virtual cameras round it.
struct CaptureScenario {
  TriangleMesh surface, proxy;
  std::vector<PosedCamera> cameras;
};

CaptureScenario scene_of(const Bench& bench, int cameras, int map_size) {
  bench.now("preparing the phantom, its proxy and cameras");
  CaptureScenario scene;
  scene.surface = OrganPhantom({}).surface(bench.quick() ? 5 : 6);
  scene.proxy = decimate(scene.surface, {}).proxy;
  scene.cameras = place_cameras(scene.surface, {.count = cameras, .map_size = map_size}).cameras;
  return scene;
}

fs::path empty_folder(const fs::path& folder) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

// What OpenEXR gets to write, made beforehand.
struct ReadyImage {
  fs::path file;
  ChannelImage image;
};

std::vector<ReadyImage> ready_images(const CaptureResult& captured, const CaptureScenario& scene,
                                     const fs::path& folder) {
  std::vector<ReadyImage> images;
  images.push_back({folder / "base.exr", base_layer_to_image(captured.base)});
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const CameraMaps& maps = captured.maps[c];
    const fs::path camera = folder / camera_folder(c);
    fs::create_directories(camera);
    images.push_back({camera / "depth.exr", depth_image(maps)});
    images.push_back({camera / "color.exr", color_image(maps)});
    images.push_back({camera / "micro.exr", micro_image(maps)});
  }
  return images;
}

std::vector<Eigen::Vector3d> stored_points(const CaptureResult& captured,
                                           const CaptureScenario& scene) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const CameraMaps& maps = captured.maps[c];
    for (std::size_t i = 0; i < maps.face.size(); ++i) {
      if (maps.face[i] == kNoFace) continue;
      points.push_back(texel_point(scene.cameras[c], i, maps.depth_mm[i]));
    }
  }
  return points;
}

void promise_binding(Bench& bench, const CaptureResult& captured, const CaptureScenario& scene) {
  bench.now("binding");
  std::vector<Eigen::Vector3d> points = stored_points(captured, scene);
  constexpr std::size_t kMost = 1'000'000;
  points.resize(std::min(points.size(), kMost));
  // As far as capture() itself makes the shell reach: 2.5 times the farthest point.
  const ShellBinder shell(scene.proxy, 2.5 * captured.largest_height_mm);
  std::vector<ShellBinding> bindings(points.size());
  const Timing timing = bench.time([&] { shell.bind(points, bindings); });
  double sum = 0;
  for (const ShellBinding& binding : bindings) sum += binding.height_mm;
  if (!std::isfinite(sum)) bench.fail("a binding is not finite");
  bench.at_most("binding, per sample and core", "ns",
                1e6 * timing.cpu_ms.median / static_cast<double>(points.size()), 60);
}

void promise_capture_time(Bench& bench) {
  const int cameras = bench.quick() ? 4 : 16, size = bench.quick() ? 256 : 1024;
  const CaptureScenario scene = scene_of(bench, cameras, size);
  const auto color = make_vertex_color(scene.surface);
  CaptureOptions options;
  options.rays_per_texel_side = 1;
  CaptureResult captured = capture(scene.surface, scene.proxy, scene.cameras, *color, options);
  const std::vector<ReadyImage> images =
      ready_images(captured, scene, empty_folder(bench.scratch() / "openexr"));
  const EmbreeTracer embree(scene.surface);
  std::vector<std::vector<float>> depths_mm;

  bench.now("trace, bind and write " + std::to_string(cameras) + " × " + std::to_string(size) +
            "²");
  const std::vector<Timing> timings = bench.time(
      {[&] {
         captured = capture(scene.surface, scene.proxy, scene.cameras, *color, options);
         write_map_files(empty_folder(bench.scratch() / "ours"), captured.maps, scene.cameras,
                         captured.base);
       },
       [&] { captured = capture(scene.surface, scene.proxy, scene.cameras, *color, options); },
       [&] { embree.trace_depths(scene.cameras, depths_mm); },
       [&] {
         parallel_for(std::size_t{0}, images.size(),
                      [&](std::size_t i) { write_by_openexr(images[i].file, images[i].image); });
       }});
  const std::string task = std::to_string(cameras) + " cameras of " + std::to_string(size) + "², " +
                           std::to_string(scene.surface.faces.size()) + " faces, one ray a texel";
  const char* names[] = {"organbake: trace, bind, write", "organbake: trace and bind",
                         "Embree, packets of 16: trace alone",
                         "OpenEXR: write alone of the same images"};
  for (std::size_t i = 0; i < timings.size(); ++i)
    bench.add(Point{task, names[i], i >= 2, {}, timings[i], {}});
  const double alone = timings[2].wall_ms.median + timings[3].wall_ms.median;
  bench.at_most("trace, bind and write / (Embree's trace + OpenEXR's write)", "×",
                timings[0].wall_ms.median / alone, 1.6);
  promise_binding(bench, captured, scene);
}

double megabytes(const fs::path& folder) {
  double bytes = 0;
  for (const fs::path& file : list_files(folder))
    bytes += static_cast<double>(fs::file_size(folder / file));
  return bytes / 1e6;
}

// Colours of eight photographs, which pack less well than a formula's.
CaptureResult photographed_maps(const Bench& bench, const CaptureScenario& scene) {
  bench.now("photographing the phantom");
  OrganPhantomOptions options;
  options.photo_count = bench.quick() ? 4 : 8;
  options.photo_size = bench.quick() ? 256 : 1024;
  const OrganPhantom phantom(options);
  std::vector<Photo> photos;
  for (const PosedCamera& camera : phantom.photo_cameras())
    photos.push_back({camera, phantom.photograph(camera, bench.context())});
  const auto color = make_photo_color(scene.surface, std::move(photos));
  return capture(scene.surface, scene.proxy, scene.cameras, *color, {});
}

void promise_size(Bench& bench) {
  const CaptureScenario scene = scene_of(bench, 8, bench.quick() ? 256 : 1024);
  const CaptureResult captured = photographed_maps(bench, scene);
  for (const bool compact : {false, true}) {
    const std::string name = compact ? "compact" : "exact";
    bench.now("packing: " + name);
    fs::path folder;
    const Timing timing = bench.time([&] {
      folder = empty_folder(bench.scratch() / "packed");
      write_map_files(folder, captured.maps, scene.cameras, captured.base, {.compact = compact});
    });
    const double size_mb = megabytes(folder);
    bench.point("8 cameras, colour from photographs: write", name, timing,
                {{"size", "MB", size_mb}});
    bench.at_most("size of 8 × 1024², " + name, "MB", size_mb, compact ? 20.0 : 30.0);
  }
}

void run_capture(Bench& bench) {
  promise_capture_time(bench);
  promise_size(bench);
}

const RegisteredPart kCapture("capture", run_capture,
                              "surface and photos to maps: time and size, beside Embree, OpenEXR");

}  // namespace
}  // namespace organbake
