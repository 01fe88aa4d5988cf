// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "organbake/core/background.h"
#include "organbake/core/run_context.h"
#include "organbake/pipelines/cache.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

// Where a step's input comes from: the user, or an earlier step of the plan.
struct InputSource {
  std::string name;
  InputKind kind = InputKind::mesh;
  std::filesystem::path given;  // empty: it is `file` of step `step`
  std::size_t step = 0;
  std::string file;
};

struct Step {
  const Stage* stage = nullptr;
  StageOptions options;
  std::string options_json;  // their canonical form
  std::vector<InputSource> inputs;
};

// Steps in running order. Only what the scene needs: a stage is there when something that it makes
// is asked for and not given.
struct Plan {
  std::vector<Step> steps;
  std::vector<LeftOut> left_out;  // what a recipe mentions or offers and this bake does not use
  bool of_recipe = false;         // not of a single stage
};

// All that a bundle needs, or (with `last_stage`) only what that stage needs, itself the last step.
// Throws RecipeError when an input is missing, UsageError for a last stage that doesn't run.
Plan plan_bake(const Recipe& recipe, const std::string& last_stage = "");

// One stage on its own. Throws UsageError when an input is missing.
Plan plan_stage(const Stage& stage, const StageOptions& options,
                const std::map<std::string, std::filesystem::path>& inputs);

struct RunOptions {
  bool force = false;  // run every step, whatever the cache holds
  // Find out what has changed since the nearest earlier run; it means reading the whole cache.
  bool explain = false;
  // Work out the SHA-256 of what users gave beside the first step that runs: a bundle tells it.
  bool sums = false;
};

// What will happen to a step, and why.
struct Forecast {
  const Step* step = nullptr;
  std::optional<StepIngredients> ingredients;  // unknown while an earlier step has yet to run
  std::optional<CacheEntry> cached;
  std::string why;
};

struct StepResult {
  const Step* step = nullptr;
  CacheEntry entry;
  bool ran = false;
  bool sound = false;                      // the files are known to be whole
  std::vector<std::string> warnings = {};  // stage_warnings(), whether it ran or was cached

  // Why the stage made nothing (StageReport::declined); empty when it did.
  std::string declined() const;
};

// Hears of each step right before it runs or is taken from the cache, and after it.
struct StepListener {
  std::function<void(const Forecast&)> before;
  std::function<void(const StepResult&)> after;
};

// Runs plans step by step against the cache. Each bake, and each single stage, goes through here.
class Runner {
 public:
  // Turns what a stage says into what is told; empty: nothing. Without it, it is told as it is.
  using Words = std::function<std::string(const std::string& said)>;
  using ContextOfStage = std::function<RunContext(const std::string& stage, const Words& words)>;

  Runner(Cache cache, StageFunction run_stage, ContextOfStage context_of)
      : cache_(std::move(cache)),
        run_stage_(std::move(run_stage)),
        context_of_(std::move(context_of)) {}

  // What run() would do, without doing it.
  std::vector<Forecast> forecast(const Plan& plan, const RunOptions& options);
  // The steps up to the last, or to the first that declined.
  std::vector<StepResult> run(const Plan& plan, const RunOptions& options,
                              const StepListener& listener = {});
  // Before an entry's files are used: hashes them again when this run did not make them, and makes
  // the step anew when the cache was damaged.
  void ensure_sound(std::vector<StepResult>& results, std::size_t step);

  const Cache& cache() const { return cache_; }
  // The content hash of a user's file or folder; each is read once.
  const std::string& hash_of_given(InputKind kind, const std::filesystem::path& path);
  // Its SHA-256; see RunOptions::sums.
  const std::string& sum_of_given(InputKind kind, const std::filesystem::path& path);

 private:
  Forecast examine(const Step& step, const std::vector<const CacheEntry*>& earlier,
                   const RunOptions& options);
  // Puts the result's warnings together, and says those that have not been said yet; but not that
  // its input was damaged, which a single stage ends with as its error.
  StepResult with_warnings(StepResult result);
  StepResult execute(const Step& step, const StepIngredients& ingredients, bool replace,
                     std::vector<StepResult>& earlier);

  // A step's message as it is told: in a bake's words, files of the cache by what they are, and
  // nothing where an earlier step has said the same of a user's file.
  std::string told(const Step& step, const std::string& text);
  StageReport run_told(const Step& step, const StageCall& call);  // errors, too

  Cache cache_;
  StageFunction run_stage_;
  ContextOfStage context_of_;
  void begin_sum(InputKind kind, const std::filesystem::path& path);

  std::map<std::filesystem::path, std::string> given_hashes_, given_sums_;
  BackgroundTasks summing_;
  bool bakes_ = false;
  std::mutex telling_;                             // a stage may speak from any of its threads
  std::map<std::string, std::string> first_told_;  // what is said of users' files: by which stage
};

// The lines that --explain prints for a step: its key, all that went into it, and the verdict.
std::vector<std::string> explanation(const Forecast& forecast);
// The warnings of all steps, the stage's name first.
std::vector<std::string> warnings_of(const std::vector<StepResult>& results);
// A stage's report as a document (schema stage-report).
std::string stage_report_json(const Stage& stage, const StageReport& report);

// Refuses early what write_stage_outputs() could not write (output_target.h).
void check_stage_target(const Stage& stage, const std::filesystem::path& target);
// Puts what a single stage made where the user wants it: one file, or a folder with the outputs and
// report.json. It appears whole or not at all. Throws IoError.
void write_stage_outputs(const StepResult& result, const std::filesystem::path& target);

// The same report for a folder that a stage wrote otherwise: by its list of files a later run knows
// the folder for its own.
std::string folder_report(const std::string& report_json, const std::vector<std::string>& files);

// A finished bake on its way into a bundle.
struct BakeResult {
  const Recipe& recipe;
  const Plan& plan;
  std::vector<StepResult>& steps;
};

enum class BundleWritten { anew, unchanged };

// Assembles the bundle folder (bundle/bundle.h) from the steps' outputs. A target that already is
// this very bundle, checked file by file, is left alone. Throws IoError.
BundleWritten write_bundle(const BakeResult& bake, Runner& runner,
                           const std::filesystem::path& target);

// [{"what": …, "why": …}, …]
nlohmann::json left_out_json(const std::vector<LeftOut>& left_out);

// Both refuse early, before hours of work, what could not be written in the end. Throw IoError
// (writing), and UsageError for a name with another ending than ".ply", say: the format is fixed.
void check_output_file(const std::filesystem::path& file, const std::filesystem::path& ending);
// A folder that exists is replaced only when it is empty or holds nothing but what a manifest.json
// or report.json of ours lists: nobody loses a file to a mistyped -o.
void check_output_folder(const std::filesystem::path& folder);

// Makes the folders above a file. Throws IoError (writing).
void make_folder_of(const std::filesystem::path& file);

// Copies one file, making the folders above it. Never a hard link: a user may change a bundle's
// file, and the cache must not change with it. Throws IoError (writing).
void copy_into(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace organbake
