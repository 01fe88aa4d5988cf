// SPDX-License-Identifier: GPL-3.0-or-later
#include "suites/baker.h"

#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/worker_process.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

fs::path organbake_program() { return program_folder() / "organbake"; }

}  // namespace

std::string organ_recipe(const std::string& name, const std::string& more) {
  // -470 HU: half-way between its tissue and air.
  return "schema: organbake/recipe/1\nname: " + name +
         "\nisosurface: {iso: -470}\ndecimate: {}\nmechanics: {}\ncapture: {}\n" + more;
}

Baker::Baker(const Bench& bench, const std::string& recipe) : bench_(bench) {
  if (!fs::exists(organbake_program())) {
    throw NoInputError(organbake_program(), "is not there; the suite bakes its bundles with it");
  }
  write_file_atomically(bench_.scratch() / "recipe.yaml", recipe);
}

nlohmann::ordered_json Baker::bake(const fs::path& bundle,
                                   std::vector<std::string> arguments) const {
  const fs::path& folder = bench_.scratch();
  std::vector<std::string> command = {organbake_program(),
                                      "bake",
                                      folder / "recipe.yaml",
                                      "-o",
                                      bundle,
                                      "--quiet",
                                      "--json",
                                      "--cache",
                                      folder / "cache"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  run_worker(command, folder / "bake.out", folder / "bake.log", bench_.context());
  return nlohmann::ordered_json::parse(read_text_file(folder / "bake.out"));
}

}  // namespace organbake
