// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <nlohmann/json.hpp>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/version.h"
#include "organbake/pipelines/content_hash.h"
#include "organbake/pipelines/options_json.h"
#include "organbake/pipelines/output_target.h"
#include "organbake/pipelines/outputs.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::json;

constexpr int kBundleVersion = 1;  // raise it when the same steps give another bundle
std::string generator() { return std::string("organbake ") + kVersion; }
constexpr const char* kSurface = "surface.ply";

// The recipe as it was run, again a recipe: every option resolved, nothing of this machine in it.
Json recipe_echo(const BakeResult& bake) {
  BundleOptions bundle = bake.recipe.bundle;
  OptionList bundle_options;
  bind(bundle_options, bundle);
  Json echo = {{"schema", "organbake/recipe/1"},
               {"name", bake.recipe.name},
               {"bundle", to_json(bundle_options)}};
  if (!bake.recipe.quality.empty()) echo["quality"] = bake.recipe.quality;
  for (const Step& step : bake.plan.steps) echo[step.stage->name] = Json::parse(step.options_json);
  return echo;
}

std::string report_json(const BakeResult& bake) {
  Json stages = Json::array();
  for (const StepResult& step : bake.steps) {
    stages.push_back(Json::parse(step.entry.record.report_json));
  }
  const Json report = {{"schema", "organbake/bake-report/1"},
                       {"stages", stages},
                       {"left_out", left_out_json(bake.plan)}};
  return report.dump(2) + "\n";
}

// The inputs that the bake read, by role.
std::map<std::string, const InputSource*> given_inputs(const Plan& plan) {
  std::map<std::string, const InputSource*> given;
  for (const Step& step : plan.steps) {
    for (const InputSource& input : step.inputs) {
      if (!input.given.empty()) given[input.name] = &input;
    }
  }
  return given;
}

Manifest make_manifest(const BakeResult& bake, Runner& runner) {
  Manifest manifest;
  manifest.name = bake.recipe.name;
  manifest.generator = generator();
  manifest.recipe_json = recipe_echo(bake).dump();
  for (const auto& [role, input] : given_inputs(bake.plan)) {
    manifest.input_hashes.emplace_back(role, runner.sum_of_given(input->kind, input->given));
  }
  for (const Step& step : bake.plan.steps) {
    const Json options = Json::parse(step.options_json);
    if (options.contains("seed")) manifest.seeds.emplace_back(step.stage->name, options["seed"]);
  }
  return manifest;
}

// What the bundle depends on, as if its assembly were one more step of the plan.
StepIngredients ingredients_of(const BakeResult& bake, Runner& runner) {
  const Json options = {{"recipe", recipe_echo(bake)},
                        {"left_out", left_out_json(bake.plan)},
                        {"generator", generator()}};
  StepIngredients ingredients{"bundle", kBundleVersion, options.dump(), {}};
  for (const StepResult& step : bake.steps) {
    ingredients.inputs[step.step->stage->name] = step.entry.ingredients.key();
  }
  for (const auto& [role, input] : given_inputs(bake.plan)) {
    ingredients.inputs["given " + role] = runner.hash_of_given(input->kind, input->given);
  }
  return ingredients;
}

// Which of a step's files go into the bundle; capture colours the surface on its way.
std::vector<std::string> parts_of(const StepResult& step, const BundleOptions& options) {
  const std::string& stage = step.step->stage->name;
  const auto belongs = [&](const std::string& file) {
    if (stage == "capture") return file != kSurface || options.surface;
    if (stage == "place") return file == "cameras.json";
    return stage == "decimate" || stage == "mechanics";
  };
  std::vector<std::string> parts;
  for (const CachedFile& file : step.entry.files) {
    if (belongs(file.path)) parts.push_back(file.path);
  }
  return parts;
}

void copy_parts(const BakeResult& bake, Runner& runner, const fs::path& folder) {
  for (std::size_t i = 0; i < bake.steps.size(); ++i) {
    const std::vector<std::string> parts = parts_of(bake.steps[i], bake.recipe.bundle);
    if (parts.empty()) continue;
    runner.ensure_sound(bake.steps, i);
    for (const std::string& file : parts) {
      copy_into(bake.steps[i].entry.folder / file, folder / file);
    }
  }
}

// Every byte is read again: a bake onto a damaged bundle mends it.
bool is_whole(const fs::path& target, const std::string& manifest_text) {
  try {
    if (!fs::exists(target / "manifest.json")) return false;
    if (read_text_file(target / "manifest.json") != manifest_text) return false;
    const BundleReader bundle(target);
    const auto& files = bundle.manifest().files;
    parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) { bundle.read(files[i].path); });
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

Json left_out_json(const Plan& plan) {
  Json list = Json::array();
  for (const LeftOut& item : plan.left_out) {
    list.push_back({{"what", item.what}, {"why", item.why}});
  }
  return list;
}

BundleWritten write_bundle(const BakeResult& bake, Runner& runner, const fs::path& target) {
  const StepIngredients ingredients = ingredients_of(bake, runner);
  const std::optional<CacheEntry> known = runner.cache().find(ingredients);
  if (known && is_whole(target, read_text_file(known->folder / "manifest.json"))) {
    AtomicFolder::sweep(target);
    return BundleWritten::unchanged;
  }
  check_output_folder(target);
  AtomicFolder folder(target);
  copy_parts(bake, runner, folder.path());
  write_file_atomically(folder.path() / "report.json", report_json(bake));
  write_manifest(folder.path(), make_manifest(bake, runner));
  runner.cache().store(ingredients, false, [&](const fs::path& entry) {
    copy_into(folder.path() / "manifest.json", entry / "manifest.json");
    return StepRecord{"{}"};
  });
  folder.commit();
  return BundleWritten::anew;
}

}  // namespace organbake
