// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbench/suites/player_bundles.h"

#include <unistd.h>

#include "core/error.h"
#include "core/files.h"
#include "pipelines/worker_process.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

constexpr const char* kRecipe = R"(schema: organbake/recipe/1
name: player benchmark
phantom: {kind: organ, seed: 1, photos: 8}
isosurface: {iso: -470}
decimate: {}
mechanics: {}
place: {count: 8}
capture: {}
bundle: {surface: true}
)";

}  // namespace

PlayerBundles::PlayerBundles(const Bench& bench)
    : bench_(bench),
      programs_(program_folder()),
      scratch_(fs::temp_directory_path() / ("organbench-" + std::to_string(::getpid()))) {
  if (!fs::exists(program("organbake"))) {
    throw NoInputError(program("organbake"), "is not there; the suite bakes its bundles with it");
  }
  fs::create_directories(scratch_);
  write_file_atomically(scratch_ / "recipe.yaml", kRecipe);
}

PlayerBundles::~PlayerBundles() {
  std::error_code ignored;  // what cannot be removed is the system's to clear
  fs::remove_all(scratch_, ignored);
}

fs::path PlayerBundles::program(const std::string& name) const { return programs_ / name; }

fs::path PlayerBundles::folder(const BakeChoice& choice) {
  const std::string faces = std::to_string(choice.faces), size = std::to_string(choice.map_size);
  const fs::path folder = scratch_ / (choice.method + "-" + faces + "-" + size);
  if (fs::exists(folder)) return folder;
  bench_.now("baking " + faces + " faces (" + choice.method + "), maps of " + size + "²");
  const fs::path log = scratch_ / "bake.log";
  std::vector<std::string> command = {
      program("organbake"), "bake", scratch_ / "recipe.yaml", "-o", folder, "--quiet", "--cache",
      scratch_ / "cache"};
  // The truth's colours are as fine as the largest maps' texels, or it would be the blurred one.
  for (const std::string& value :
       {"decimate.faces=" + faces, "decimate.method=" + choice.method, "place.size=" + size,
        std::string("phantom.size=") + (bench_.quick() ? "96,96,40" : "256,256,96"),
        std::string("phantom.photo_size=") + (bench_.quick() ? "256" : "1024"),
        std::string("capture.surface_edge=") + (bench_.quick() ? "2" : "0.7")}) {
    command.insert(command.end(), {"--set", value});
  }
  run_worker(command, scratch_ / "bake.out", log, bench_.context());
  return folder;
}

}  // namespace organbake
