// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the steps of a plan: from the cache where nothing changed, else by their modules; and what
// it will do, told before.
#include "organbake/pipelines/runner.h"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/bake_report.h"
#include "organbake/pipelines/documents.h"
#include "organbake/pipelines/options_json.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::json;

StageCall make_call(const Step& step, const fs::path& folder, const RunContext& context,
                    const std::vector<StepResult>& earlier) {
  StageCall call{step.options.storage.get(), step.options_json, {}, folder, context};
  for (const InputSource& input : step.inputs) {
    if (!input.given.empty()) {
      call.inputs[input.name] = input.given;
      continue;
    }
    const StepResult& maker = earlier[input.step];
    const fs::path made = maker.entry.folder / input.file;
    const StageOutput* output = maker.step->stage->output(input.name);
    if (output && output->may_be_missing && !fs::exists(made)) continue;
    call.inputs[input.name] = made;
  }
  return call;
}

// A module that is missing is told of when its stage is to run.
std::string program_of(const Stage& stage) {
  const fs::path module = module_file(stage.name);
  return fs::exists(module) ? quick_hash_of_file(module) : "";
}

// What stages load for themselves: readers of rare files, contours. One that an earlier step of
// this process loaded is among them, whether this one used it or not.
std::map<std::string, std::string> shared_modules() {
  std::map<std::string, std::string> modules;
  for (const fs::path& file : loaded_modules()) {
    const std::string name = file.filename();
    if (!name.starts_with("stage_")) modules[name] = quick_hash_of_file(file);
  }
  return modules;
}

}  // namespace

std::string StepResult::declined() const {
  return Json::parse(entry.record.report_json).value("declined", "");
}

const std::string& Runner::hash_of_given(InputKind kind, const fs::path& path) {
  const auto known = given_hashes_.find(path);
  if (known != given_hashes_.end()) return known->second;
  const std::string hash = content_hash(kind, path, quick_hash_of_file);
  if (kind == InputKind::cameras || kind == InputKind::photos) check_json_file(path, "cameras");
  return given_hashes_[path] = hash;
}

void Runner::begin_sum(InputKind kind, const fs::path& path) {
  const auto [place, is_new] = given_sums_.try_emplace(path);
  if (!is_new) return;
  summing_.run(
      [kind, path, &sum = place->second] { sum = content_hash(kind, path, sha256_of_file); });
}

const std::string& Runner::sum_of_given(InputKind kind, const fs::path& path) {
  begin_sum(kind, path);
  summing_.wait();
  return given_sums_.at(path);
}

Forecast Runner::examine(const Step& step, const std::vector<const CacheEntry*>& earlier,
                         const RunOptions& options) {
  StepIngredients ingredients{step.stage->name, program_of(*step.stage), step.options_json, {}};
  for (const InputSource& input : step.inputs) {
    if (!input.given.empty()) {
      ingredients.inputs[input.name] = hash_of_given(input.kind, input.given);
    } else if (const CacheEntry* entry = earlier[input.step]) {
      ingredients.inputs[input.name] = entry->content_hash(input.file);
    } else {
      return {&step, {}, {}, "its " + input.name + " is made anew"};
    }
  }
  if (options.force) return {&step, ingredients, {}, "asked for"};
  if (auto entry = cache_.find(ingredients)) {
    return {&step, ingredients, std::move(entry), "nothing that it depends on has changed"};
  }
  if (!options.explain) return {&step, ingredients, {}, "it is not in the cache"};
  const auto nearest = cache_.nearest(ingredients);
  const std::string why =
      nearest ? joined(differences(*nearest, ingredients), "; ") : "it never ran";
  return {&step, ingredients, {}, why};
}

std::vector<Forecast> Runner::forecast(const Plan& plan, const RunOptions& options) {
  std::vector<Forecast> forecasts;
  forecasts.reserve(plan.steps.size());
  std::vector<const CacheEntry*> entries;
  for (const Step& step : plan.steps) {
    forecasts.push_back(examine(step, entries, options));
    const auto& cached = forecasts.back().cached;
    entries.push_back(cached ? &*cached : nullptr);
  }
  return forecasts;
}

std::vector<StepResult> Runner::run(const Plan& plan, const RunOptions& options,
                                    const StepListener& listener) {
  // An entry that somebody else has finished meanwhile is written by nobody any more, who would
  // tidy up after those that were killed.
  AtomicFolder::sweep_inside(cache_.folder());
  bakes_ = plan.of_recipe;
  std::vector<StepResult> results;
  results.reserve(plan.steps.size());
  for (const Step& step : plan.steps) {
    std::vector<const CacheEntry*> entries;
    for (const StepResult& result : results) entries.push_back(&result.entry);
    const Forecast forecast = examine(step, entries, options);
    if (listener.before) listener.before(forecast);
    if (options.sums && !forecast.cached) {
      for (const InputSource& input : step.inputs)
        if (!input.given.empty()) begin_sum(input.kind, input.given);
    }
    results.push_back(forecast.cached
                          ? with_warnings({&step, *forecast.cached})
                          : execute(step, *forecast.ingredients, options.force, results));
    if (listener.after) listener.after(results.back());
    if (!results.back().declined().empty()) break;
  }
  return results;
}

StepResult Runner::execute(const Step& step, const StepIngredients& ingredients, bool replace,
                           std::vector<StepResult>& earlier) {
  for (const InputSource& input : step.inputs) {
    if (input.given.empty()) ensure_sound(earlier, input.step);
  }
  StepRecord record;
  std::mutex mutex;  // a stage may warn from any of its threads
  const auto remember = [&](LogLevel level, std::string_view text) {
    const std::lock_guard lock(mutex);
    if (level == LogLevel::warning) record.warnings.emplace_back(text);
  };
  const RunContext context = context_of_(step.stage->name, [&](const std::string& said) {
                               return told(step, said);
                             }).heard_by(remember);
  context.throw_if_cancelled();
  context.progress(0);
  const auto start = std::chrono::steady_clock::now();
  CacheEntry entry = cache_.store(ingredients, replace, [&](const fs::path& folder) {
    const StageReport report = run_told(step, make_call(step, folder, context, earlier));
    record.report_json = stage_report_json(*step.stage, report);
    record.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    record.modules = shared_modules();
    return record;
  });
  context.progress(1);
  return with_warnings({&step, std::move(entry), true, true});
}

StageReport Runner::run_told(const Step& step, const StageCall& call) {
  try {
    return run_stage_(*step.stage, call);
  } catch (const Error& error) {
    const std::string words = told(step, error.what());
    if (words.empty() || words == error.what()) throw;
    throw Error(error.code(), words);
  }
}

std::string Runner::told(const Step& step, const std::string& text) {
  const std::string& stage = step.stage->name;
  std::string words = bakes_ ? in_bake_words(stage, text) : text;
  const std::string cache = cache_.folder().string() + "/";
  // The unit that was given is of the user's files; that our own say theirs is no news.
  if (words.starts_with(cache) && words.find(": says itself that it is in ") != words.npos)
    return {};
  for (std::size_t at = 0; (at = words.find(cache, at)) != words.npos;) {
    const std::size_t end = words.find_first_of(": ", at + cache.size());
    words.erase(at, words.rfind('/', end) + 1 - at);
  }
  const std::lock_guard lock(telling_);
  for (const InputSource& input : step.inputs) {
    if (input.given.empty() || !words.starts_with(input.given.string() + ": ")) continue;
    if (first_told_.try_emplace(words, stage).first->second != stage) return {};
  }
  return words;
}

StepResult Runner::with_warnings(StepResult result) {
  const StepRecord& record = result.entry.record;
  const Json report = Json::parse(record.report_json);
  std::vector<std::string> all;
  for (const std::string& warning : record.warnings)
    if (std::string words = told(*result.step, warning); !words.empty()) all.push_back(words);
  result.warnings = stage_warnings(report, all, bakes_);
  std::vector<std::string> said = {told(*result.step, report.value("bad_data", ""))};
  if (result.ran) said.insert(said.end(), all.begin(), all.end());
  const RunContext context = context_of_(result.step->stage->name, {});
  for (const std::string& warning : result.warnings) {
    if (std::find(said.begin(), said.end(), warning) == said.end()) context.warn(warning);
  }
  return result;
}

void Runner::ensure_sound(std::vector<StepResult>& results, std::size_t step) {
  StepResult& result = results[step];
  result.sound = result.sound || result.entry.sound();
  if (result.sound) return;
  context_of_(result.step->stage->name, {})
      .warn("its files in the cache are damaged; it runs again");
  result = execute(*result.step, result.entry.ingredients, true, results);
}

std::vector<std::string> explanation(const Forecast& forecast) {
  const Step& step = *forecast.step;
  std::vector<std::string> lines = {step.stage->name + ": " +
                                    (forecast.cached ? "cached" : "to run") + ", because " +
                                    forecast.why};
  if (forecast.ingredients) lines.push_back("  key      " + forecast.ingredients->key());
  lines.push_back("  options  " + step.options_json);
  for (const InputSource& input : step.inputs) {
    const auto* known = forecast.ingredients ? &forecast.ingredients->inputs : nullptr;
    lines.push_back("  input    " + input.name + " " +
                    (known ? known->at(input.name) : "(not yet made)"));
  }
  return lines;
}

std::vector<std::string> warnings_of(const std::vector<StepResult>& results) {
  std::vector<std::string> all;
  for (const StepResult& result : results)
    for (const std::string& warning : result.warnings)
      all.push_back(result.step->stage->name + ": " + warning);
  return all;
}

std::string stage_report_json(const Stage& stage, const StageReport& report) {
  Json figures = Json::object();
  for (const auto& [name, value] : report.figures) figures[name] = to_json(value);
  Json json = {{"schema", "organbake/stage-report/1"},
               {"stage", stage.name},
               {"figures", figures},
               {"skipped", left_out_json(report.skipped)}};
  if (!report.bad_data.empty()) json["bad_data"] = report.bad_data;
  if (!report.quality_gate.empty()) json["quality_gate"] = report.quality_gate;
  if (!report.declined.empty()) json["declined"] = report.declined;
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

namespace {

// "beside/overlay.png" of a result pose.json goes to pose_overlay.png.
void write_beside(const CacheEntry& entry, const fs::path& target) {
  const std::string prefix = std::string(Stage::kBeside) + "/";
  for (const CachedFile& file : entry.files) {
    if (!file.path.starts_with(prefix)) continue;
    const fs::path beside =
        target.parent_path() / (target.stem().string() + "_" + file.path.substr(prefix.size()));
    make_folder_of(beside);
    write_file_atomically(beside, read_file(entry.folder / file.path));
  }
}

}  // namespace

std::string folder_report(const std::string& report_json, const std::vector<std::string>& files) {
  nlohmann::json report = nlohmann::json::parse(report_json);
  report["files"] = files;
  return report.dump(2) + "\n";
}

void check_stage_target(const Stage& stage, const fs::path& target) {
  if (stage.single_file) {
    check_output_file(target, fs::path(stage.outputs.front().file).extension());
  } else {
    check_output_folder(target);
  }
}

void write_stage_outputs(const StepResult& result, const fs::path& target) {
  const Stage& stage = *result.step->stage;
  check_stage_target(stage, target);
  if (stage.single_file) {
    make_folder_of(target);
    write_file_atomically(target, read_file(result.entry.folder / stage.outputs.front().file));
    write_beside(result.entry, target);
    return;
  }
  AtomicFolder folder(target);
  std::vector<std::string> files;
  for (const CachedFile& file : result.entry.files) {
    copy_into(result.entry.folder / file.path, folder.path() / file.path);
    files.push_back(file.path);
  }
  write_file_atomically(folder.path() / "report.json",
                        folder_report(result.entry.record.report_json, files));
  folder.commit();
}

}  // namespace organbake
