// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "error_measures.h"
#include "organbake/bundle/map_files.h"
#include "organbake/capture/capture.h"
#include "organbake/capture/smooth_normals.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/geometry/shell_map.h"
#include "organbake/phantom/phantom.h"
#include "peers/exact_depth.h"
#include "suites/capture_parts.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// Whether a texel's ray, which meets the surface, does so at no grazing angle: those aren't kept.
bool kept_for_sure(const RayScene& scene, const SmoothNormals& normals, const Ray& ray) {
  constexpr double kLeastCosine = 0.2;
  RayHit hit;
  scene.first_hits({&ray, 1}, {&hit, 1});
  return hit.face == kNoHit || -normals.at(hit).dot(ray.direction.normalized()) > kLeastCosine;
}

void promise_depth(Bench& bench, const CaptureResult& captured, const CaptureScenario& scene) {
  bench.now("depth against an exact oracle");
  constexpr int kTexels = 10'000;
  constexpr std::uint64_t kSeed = 6;
  const ExactDepth oracle(scene.surface);
  const RayScene rays(scene.surface);
  const SmoothNormals normals(scene.surface);
  RandomStream random(kSeed);
  double worst = 0;
  int met = 0, met_by_one = 0;
  while (met < kTexels) {
    const std::size_t c = random.below(scene.cameras.size());
    const CameraMaps& maps = captured.maps[c];
    const std::size_t texel = random.below(maps.face.size());
    const Ray ray = texel_ray(scene.cameras[c], texel);
    const double exact = oracle.first_hit(ray.origin, ray.direction);
    const bool ours = std::isfinite(maps.depth_mm[texel]);
    if (ours != std::isfinite(exact) && (ours || kept_for_sure(rays, normals, ray))) ++met_by_one;
    if (!ours || !std::isfinite(exact)) continue;
    worst = std::max(worst, std::abs(maps.depth_mm[texel] - exact) / exact);
    ++met;
  }
  bench.add(
      Figure{"depth at 10,000 texels' centres against CGAL, worst", "of the depth", worst, 1e-5});
  bench.add(Figure{"texels that only one of both says are hit, grazing ones aside", "",
                   double(met_by_one), 0});
}

// What a player makes of the files against the surface point that was baked, over all texels.
struct SplitError {
  double worst_mm = 0;
  std::size_t unbound = 0;
};

SplitError split_error(const fs::path& folder, const CaptureResult& captured,
                       const CaptureScenario& scene) {
  const std::vector<ShellMatrix> shells = shell_matrices(scene.proxy);
  SplitError error;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const std::string name = camera_folder(c);
    const ChannelImage depth = read_exr(folder / name / "depth.exr"),
                       micro = read_exr(folder / name / "micro.exr");
    const std::vector<float>&z = depth.floats("Y", name), &h = micro.floats("Y", name);
    const std::vector<std::uint32_t>& faces = micro.uints("face", name);
    const PosedCamera& camera = scene.cameras[c];
    for (std::size_t i = 0; i < z.size(); ++i) {
      const double baked_mm = captured.maps[c].depth_mm[i];
      if (!std::isfinite(baked_mm)) continue;
      if (faces[i] == kNoFace) {
        ++error.unbound;
        continue;
      }
      const Eigen::Vector3d point =
          rejoined_point(shells[faces[i]], h[i], texel_point(camera, i, z[i]));
      const Eigen::Vector3d baked = texel_point(camera, i, baked_mm);
      error.worst_mm = std::max(error.worst_mm, (point - baked).norm());
    }
  }
  return error;
}

double megabytes(const fs::path& folder) {
  double bytes = 0;
  for (const fs::path& file : list_files(folder))
    bytes += static_cast<double>(fs::file_size(folder / file));
  return bytes / 1e6;
}

struct NamedPacking {
  const char* name;
  MapPacking packing;
};
const NamedPacking kPackings[] = {
    {"zip, level 6 (default)", {}},
    {"zip, level 1", {.zip_level = 1}},
    {"zip, level 10", {.zip_level = 10}},
    {"piz", {.compression = ExrCompression::piz}},
    {"pxr24", {.compression = ExrCompression::pxr24}},
    {"none", {.compression = ExrCompression::none}},
    {"compact", {.compact = true}},
};

void sweep_packings(Bench& bench, const CaptureResult& captured, const CaptureScenario& scene) {
  const std::string task = std::to_string(scene.cameras.size()) + " cameras of " +
                           std::to_string(scene.cameras.front().intrinsics.width) +
                           "², colour from photographs: write";
  for (const auto& [name, packing] : kPackings) {
    bench.now(std::string("packing: ") + name);
    fs::path folder;
    const Timing timing = bench.time([&] {
      folder = fresh_folder(bench, "packed");
      write_map_files(folder, captured.maps, scene.cameras, captured.base, packing);
    });
    const SplitError error = split_error(folder, captured, scene);
    const double size_mb = megabytes(folder);
    bench.add(Point{task,
                    name,
                    false,
                    {},
                    timing,
                    {{"size", "MB", size_mb}, {"macro + micro, worst", "mm", error.worst_mm}}});
    const bool standard = packing.compression == ExrCompression::zip && !packing.compact;
    if (packing.zip_level < MapPacking().zip_level || (!standard && !packing.compact)) continue;
    const std::string kind = standard ? std::string("exact, ") + name : "compact";
    bench.add(Figure{"macro + micro = surface, " + kind + ", worst texel", "mm", error.worst_mm,
                     standard ? 0.001 : 0.01});
    bench.add(Figure{"texels left unbound, " + kind, "", double(error.unbound), 0});
    bench.add(Figure{"size of 8 × 1024², " + kind, "MB", size_mb, standard ? 30.0 : 20.0});
  }
}

}  // namespace

void promise_capture_maps(Bench& bench) {
  bench.now("photographing the phantom");
  const CaptureScenario scene = capture_scenario(bench, 8, bench.quick() ? 256 : 1024);
  OrganPhantomOptions options;
  options.photo_count = bench.quick() ? 4 : 8;
  options.photo_size = bench.quick() ? 256 : 1024;
  const OrganPhantom phantom(options);
  std::vector<Photo> photos;
  for (const PosedCamera& camera : phantom.photo_cameras())
    photos.push_back({camera, phantom.photograph(camera, bench.context())});
  const auto color = make_photo_color(scene.surface, RayScene(scene.surface), std::move(photos));
  const CaptureResult captured = capture(scene.surface, scene.proxy, scene.cameras, *color, {});
  promise_depth(bench, captured, scene);
  sweep_packings(bench, captured, scene);
}

}  // namespace organbake
