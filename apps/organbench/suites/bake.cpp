// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "bench.h"
#include "measuring/baker.h"
#include "measuring/bundle_errors.h"
#include "organbake/phantom/phantom.h"
#include "organbake/pipelines/quality.h"
#include "organbake/volume/read_volume.h"
#include "organbake/volume/write_volume.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

double seconds_of(const nlohmann::ordered_json& bake) {
  double seconds = 0;
  for (const auto& stage : bake.at("stages")) seconds += stage.at("seconds").get<double>();
  return seconds;
}

// One CT, baked again and again with other options.
class BakeScene {
 public:
  explicit BakeScene(Bench& bench)
      : bench_(bench),
        baker_(bench.scratch(), bench.context(),
               organ_recipe("a CT to a bundle", "bundle: {surface: true}\n")) {
    OrganPhantomOptions options;
    options.ct_size = bench.quick() ? std::array{64, 64, 38} : std::array{512, 512, 300};
    options.spacing_mm = {0.7, 0.7, 1};
    const auto& [nx, ny, nz] = options.ct_size;
    task_ = "CT of " + std::to_string(nx) + "×" + std::to_string(ny) + "×" + std::to_string(nz) +
            " to a bundle of 80 faces";
    bench.now("scanning the phantom");
    write_metaimage(ct(), OrganPhantom(options).scan(bench.context()));
    reading_ = bench.time([&] { read_volume(ct(), bench.context()); });
  }

  // A point of the curve. Returns the seconds of all stages but for reading the CT, median.
  double bake(const std::string& subject, const std::vector<std::string>& arguments,
              Quantities knobs) {
    bench_.now(task_ + ", " + subject);
    const fs::path bundle = bench_.scratch() / "bundle";
    std::vector<std::string> all = {"--force", "--set", "ct=" + ct().string()};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<double> seconds;
    const Timing timing =
        bench_.time([&] { seconds.push_back(seconds_of(baker_.bake(bundle, all))); });
    const Quantities errors = bundle_errors(bundle, bench_.quick() ? 360 : 720);
    picture_levels_ = errors.front().value;
    bench_.point(task_, subject, timing, errors, std::move(knobs));
    return spread_of(seconds).median - 1e-3 * reading_.wall_ms.median;
  }

  const std::string& task() const { return task_; }
  // Of the last bake.
  double picture_levels() const { return picture_levels_; }

 private:
  fs::path ct() const { return bench_.scratch() / "ct.mha"; }

  Bench& bench_;
  Baker baker_;
  std::string task_;
  Timing reading_;
  double picture_levels_ = 0;
};

// In a quick run with maps of a quarter of their size.
void bake_quality(Bench& bench, BakeScene& scene, const std::string& quality) {
  std::vector<std::string> arguments = {"--quality", quality};
  for (const auto& [section, key, value] : quality_options(quality)) {
    if (bench.quick() && key == "size")
      arguments.insert(arguments.end(),
                       {"--set", "place.size_px=" + std::to_string(std::stoi(value) / 4)});
  }
  scene.bake("--quality " + quality + (bench.quick() ? ", small maps" : ""), arguments, {});
  if (!bench.quick() && quality == "standard")
    bench.at_most(scene.task() + ": pictures, RMS", "levels", scene.picture_levels(), 2);
}

void sweep_map_sizes(Bench& bench, BakeScene& scene) {
  for (const int size : {256, 1024, 2048}) {  // standard has 512
    const double seconds =
        scene.bake("standard but for its maps", {"--set", "place.size_px=" + std::to_string(size)},
                   {{"maps", "px", double(size)}});
    if (size == 1024)
      bench.at_most(scene.task() + ", maps of 1024²: all stages without reading", "s", seconds, 5);
  }
}

// What each of a quality's options is worth by itself; maps of any size have been swept.
void sweep_options(BakeScene& scene) {
  const auto standard = quality_options("standard");
  for (const std::string quality : {"draft", "fine"}) {
    const auto options = quality_options(quality);
    for (std::size_t i = 0; i < options.size(); ++i) {
      const auto& [section, key, value] = options[i];
      if (key == "size" || value == standard[i].value) continue;
      const std::string setting = section + "." + key + "=" + value;
      scene.bake("standard but " + setting, {"--set", setting}, {});
    }
  }
}

void run_bake(Bench& bench) {
  BakeScene scene(bench);
  for (const std::string& quality : quality_names()) bake_quality(bench, scene, quality);
  if (bench.quick()) return;
  sweep_options(scene);
  sweep_map_sizes(bench, scene);
}

const RegisteredPart kBake(
    "bake", run_bake,
    "a whole CT to a bundle: draft, standard, fine and what lies between, against the picture");

}  // namespace
}  // namespace organbake
