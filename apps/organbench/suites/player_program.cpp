// SPDX-License-Identifier: GPL-3.0-or-later
#include "suites/player_parts.h"

#include <nlohmann/json.hpp>

#include "organbake/core/files.h"
#include "organbake/pipelines/worker_process.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

constexpr double kMb = double(1 << 20);

}  // namespace

void promise_program(Bench& bench, PlayerBundles& bundles) {
  const int map_size = bundles.map_size();
  const fs::path bundle = bundles.folder({80, "fitted", map_size}), scratch = bench.scratch();
  const std::string organplay = bundles.program("organplay");
  if (!fs::exists(organplay)) return bench.skip("organplay's start", organplay + " is not there");
  bench.now("organplay's start");
  constexpr const char* kBetweenCameras = "0.705723,0";  // a view that needs three of them
  double peak_mb = 0;
  std::vector<double> first_frame_ms;
  for (int round = 0; round < bench.count(2, 5, 9); ++round) {
    run_worker({organplay, bundle, "--bench", "1", "--json", "--size", "1280x720", "--view",
                kBetweenCameras},
               scratch / "program.out", scratch / "program.log", bench.context());
    const auto report = nlohmann::json::parse(read_text_file(scratch / "program.out"));
    // Its own word: the system's for a child counts what this program held when it was started.
    peak_mb = report.at("peak_memory_mb");
    first_frame_ms.push_back(report.at("load_to_first_frame_ms"));
  }
  const std::string maps =
      std::to_string(PlayerBundles::kCameras) + " maps of " + std::to_string(map_size) + "²";
  bench.add(Figure{"a new organplay, load to first frame of 720p, checksums included, " + maps, "s",
                   spread_of(first_frame_ms).median / 1000, 0.4});
  // All cameras loaded. A texel: depth as float, colour and height as halves.
  constexpr double kBytesPerTexel = 4 + 3 * 2 + 2;
  const double maps_mb = kBytesPerTexel * PlayerBundles::kCameras * map_size * map_size / kMb;
  if (!bench.quick())
    bench.add(Figure{"organplay's memory with " + maps + " / the maps", "×", peak_mb / maps_mb, 3});

  const fs::path strip = "/usr/bin/strip";
  if (!fs::exists(strip)) return bench.skip("organplay's size", "there is no " + strip.string());
  run_worker({strip, "-o", scratch / "stripped", organplay}, scratch / "program.out",
             scratch / "program.log", bench.context());
  bench.add(Figure{"organplay with all its own libraries, stripped", "MB",
                   double(fs::file_size(scratch / "stripped")) / kMb, 5});
}

}  // namespace organbake
