// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "bench.h"
#include "measuring/capture_scenario.h"
#include "measuring/error_measures.h"
#include "organbake/bundle/map_files.h"
#include "organbake/capture/capture.h"
#include "organbake/core/files.h"
#include "organbake/geometry/shell_map.h"
#include "organbake/image/exr.h"
#include "organbake/phantom/phantom.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

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

// Of eight photographs.
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

void sweep_packings(Bench& bench) {
  const CaptureScenario scene =
      capture_scenario(8, bench.quick() ? 256 : 1024, bench.quick() ? 5 : 6);
  const CaptureResult captured = photographed_maps(bench, scene);
  const std::string task = std::to_string(scene.cameras.size()) + " cameras of " +
                           std::to_string(scene.cameras.front().intrinsics.width) +
                           "², colour from photographs: write";
  for (const auto& [name, packing] : kPackings) {
    bench.now(std::string("packing: ") + name);
    fs::path folder;
    const Timing timing = bench.time([&] {
      folder = empty_folder(bench.scratch() / "packed");
      write_map_files(folder, captured.maps, scene.cameras, captured.base, packing);
    });
    const SplitError error = split_error(folder, captured, scene);
    const double size_mb = megabytes(folder);
    bench.point(task, name, timing,
                {{"size", "MB", size_mb}, {"macro + micro, worst", "mm", error.worst_mm}});
    const bool standard = packing.compression == ExrCompression::zip && !packing.compact;
    if (packing.zip_level < MapPacking().zip_level || (!standard && !packing.compact)) continue;
    const std::string kind = standard ? std::string("exact, ") + name : "compact";
    bench.at_most("macro + micro = surface, " + kind + ", worst texel", "mm", error.worst_mm,
                  standard ? 0.001 : 0.01);
    bench.at_most("texels left unbound, " + kind, "", double(error.unbound), 0);
    bench.at_most("size of 8 × 1024², " + kind, "MB", size_mb, standard ? 30.0 : 20.0);
  }
}

const RegisteredPart kCaptureMaps("capture", sweep_packings);

}  // namespace
}  // namespace organbake
