// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <nlohmann/json.hpp>

#include "bundle/bundle.h"
#include "organbench/suites.h"
#include "organbench/suites/baker.h"
#include "phantom/phantom.h"
#include "player/orbit.h"
#include "player/projection_error.h"
#include "raycast/ray_scene.h"
#include "volume/read_volume.h"
#include "volume/write_volume.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

double seconds_of(const nlohmann::ordered_json& bake) {
  double seconds = 0;
  for (const auto& stage : bake.at("stages")) seconds += stage.at("seconds").get<double>();
  return seconds;
}

// What comes out, against the surface that went in.
std::vector<Quantity> errors_of(const fs::path& folder) {
  const BundleReader reader(folder);
  const Bundle bundle = reader.read_all();
  const TriangleMesh surface = reader.read_surface();
  const RayScene proxy(bundle.proxy);
  double squares = 0;
  for (const Eigen::Vector3d& v : surface.vertices)
    squares += std::pow(proxy.closest_point(v).distance_mm, 2);
  const CarriedSurface truth(surface, bundle.proxy);
  const ProjectionErrors projection =
      ProjectionComparison(bundle, truth)
          .measure(bundle.proxy.vertices, orbit_view(bundle.cameras, {0.2, 0.1}, 1280, 720));
  return {
      {"vertices projected at 720p, mean error", "px", projection.image_based.mean_px},
      {"the same by the proxy's polygons", "px", projection.polygons.mean_px},
      {"vertices to the proxy, RMS", "mm", std::sqrt(squares / double(surface.vertices.size()))}};
}

}  // namespace

void run_bake_suite(Bench& bench) {
  const Baker baker(
      bench, organ_recipe("a CT to a bundle", "place: {count: 8}\nbundle: {surface: true}\n"));
  OrganPhantomOptions options;
  options.ct_size = bench.quick() ? std::array{64, 64, 38} : std::array{512, 512, 300};
  options.spacing_mm = {0.7, 0.7, 1};
  const auto& [nx, ny, nz] = options.ct_size;
  const std::string task = "CT of " + std::to_string(nx) + "×" + std::to_string(ny) + "×" +
                           std::to_string(nz) + " to a bundle of 8 cameras, 80 faces";
  bench.now("scanning the phantom");
  const fs::path ct = bench.scratch() / "ct.mha";
  write_metaimage(ct, OrganPhantom(options).scan(bench.context()));
  const Timing reading = bench.time([&] { read_volume(ct, bench.context()); });
  const std::vector<int> sizes =
      bench.quick() ? std::vector{128} : std::vector{256, 512, 1024, 2048};
  for (const int size : sizes) {
    const std::string maps = std::to_string(size);
    bench.now(task + ", maps of " + maps + "²");
    const fs::path bundle = bench.scratch() / ("bundle " + maps);
    std::vector<double> without_reading_s;
    const Timing timing = bench.time([&] {
      const auto report = baker.bake(
          bundle, {"--force", "--set", "ct=" + ct.string(), "--set", "place.size=" + maps});
      without_reading_s.push_back(seconds_of(report) - 1e-3 * reading.wall_ms.median);
    });
    bench.add(Point{
        task, "organbake bake", false, {{"maps", "px", double(size)}}, timing, errors_of(bundle)});
    if (size == 1024) {
      bench.add(Figure{task + ", maps of 1024²: all stages without reading", "s",
                       spread_of(without_reading_s).median, 5});
    }
  }
}

}  // namespace organbake
