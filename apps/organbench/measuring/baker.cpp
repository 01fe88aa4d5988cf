// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/baker.h"

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

Baker::Baker(fs::path folder, RunContext context, const std::string& recipe)
    : folder_(std::move(folder)), context_(std::move(context)) {
  if (!fs::exists(organbake_program())) {
    throw NoInputError(organbake_program(), "is not there; the bundles are baked with it");
  }
  write_file_atomically(folder_ / "recipe.yaml", recipe);
}

nlohmann::ordered_json Baker::bake(const fs::path& bundle,
                                   std::vector<std::string> arguments) const {
  std::vector<std::string> command = {organbake_program(), "bake", "--quiet", "--json"};
  command.insert(command.end(),
                 {folder_ / "recipe.yaml", "-o", bundle, "--cache", folder_ / "cache"});
  command.insert(command.end(), arguments.begin(), arguments.end());
  run_worker(command, folder_ / "bake.out", folder_ / "bake.log", context_);
  return nlohmann::ordered_json::parse(read_text_file(folder_ / "bake.out"));
}

}  // namespace organbake
