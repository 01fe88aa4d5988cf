// SPDX-License-Identifier: GPL-3.0-or-later
// organbake plan: a batch for a cluster.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/processes.h"
#include "organbake/pipelines/recipe.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct PlanFlags {
  BatchOptions cases;
  std::string emit = "lines";
  int tasks = 0;
  double task_minutes = 10, most_hours = 24;
};

OptionList plan_flag_list(PlanFlags& flags) {
  OptionList list;
  list.add("emit", &flags.emit,
           {.help = "a command a line, a Snakefile, or a script for sbatch",
            .choices = {"lines", "snakemake", "slurm"}});
  add_case_flags(list, flags.cases);
  list.add("tasks", &flags.tasks,
           {.help = "number of tasks; 0 = so many that each lasts about --task-minutes",
            .range = {0, 100'000}})
      .add("task_minutes", &flags.task_minutes,
           {.help = "how long a task with several cases should last: starting one costs a cluster "
                    "about a second",
            .unit = "min",
            .range = {0.01, 1e6}})
      .add("hours", &flags.most_hours,
           {.help = "the most that one case may take", .unit = "h", .range = {0.001, 1e5}});
  return list;
}

constexpr double kSecondsPerMinute = 60, kMinutesPerHour = 60;

// The stages are not parallel all through: a second core saves less than half.
double wall_seconds(double cpu_seconds, int threads) {
  constexpr double kParallelShare = 0.7;
  return cpu_seconds * (1 - kParallelShare + kParallelShare / threads);
}

// Refuses what can't work, before the first hour is spent on it.
void check_that_it_fits(const std::vector<BatchCase>& cases,
                        const std::vector<CaseEstimate>& estimates, const PlanFlags& flags,
                        int threads) {
  const double memory_mb =
      flags.cases.memory_mb > 0 ? flags.cases.memory_mb : machine_memory().total_mb;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const std::string who = "case '" + cases[i].name + "' needs about ";
    if (estimates[i].memory_mb > memory_mb) {
      throw UsageError(who + to_text(estimates[i].memory_mb, 0) + " MB, but there are " +
                       to_text(memory_mb, 0) +
                       " MB: give --memory MB of the machine it shall run on, or a smaller input "
                       "(isosurface.roi_mm, place.size_px)");
    }
    const double hours =
        wall_seconds(estimates[i].cpu_seconds, threads) / (kSecondsPerMinute * kMinutesPerHour);
    if (hours > flags.most_hours) {
      throw UsageError(who + to_text(hours, 2) + " hours, but --hours allows " +
                       to_text(flags.most_hours) +
                       ": raise it, give more --threads, or set less "
                       "to do (shade.every, place.size_px)");
    }
  }
}

// For all cases alike, as jobs that start in another folder must have it.
std::vector<std::string> arguments_of(const BatchOptions& flags) {
  std::vector<std::string> words = {"--recipe", fs::absolute(flags.recipe).string()};
  for (std::string setting : flags.settings) {
    const std::size_t equals = setting.find('=');
    const bool path = equals != std::string::npos && equals + 1 < setting.size() &&
                      is_recipe_input(setting.substr(0, equals));
    if (path) {
      setting = setting.substr(0, equals + 1) + fs::absolute(setting.substr(equals + 1)).string();
    }
    words.insert(words.end(), {"--set", setting});
  }
  if (!flags.pictures) words.emplace_back("--no-pictures");
  if (flags.strict) words.emplace_back("--strict");
  if (!flags.cache.empty()) {
    words.insert(words.end(), {"--cache", fs::absolute(flags.cache).string()});
  }
  for (const std::string& word : words) {
    if (word.find('\n') == std::string::npos) continue;
    throw UsageError("'" + word + "' holds a line break, which no list of commands can carry");
  }
  return words;
}

// The longest task's wall time: every n-th case is its.
double longest_task_seconds(const std::vector<CaseEstimate>& estimates, std::size_t tasks,
                            int threads) {
  std::vector<double> seconds(tasks, 0);
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    seconds[i % tasks] += wall_seconds(estimates[i].cpu_seconds, threads);
  }
  return *std::max_element(seconds.begin(), seconds.end());
}

std::size_t number_of_tasks(const std::vector<CaseEstimate>& estimates, const PlanFlags& flags,
                            int threads) {
  constexpr double kLargestArray = 1000;  // Slurm's MaxArraySize is 1001 unless raised
  double wanted = flags.tasks;
  if (flags.tasks == 0) {
    wanted = std::ceil(longest_task_seconds(estimates, 1, threads) /
                       (flags.task_minutes * kSecondsPerMinute));
    wanted = std::min(wanted, kLargestArray);
  }
  return std::size_t(std::clamp(wanted, 1.0, double(estimates.size())));
}

JobPlan job_plan(const std::vector<CaseEstimate>& estimates, const PlanFlags& flags, int threads) {
  // What a cluster's engine grants, kills: its nodes may be half as fast, its files slow.
  constexpr double kMoreTime = 4, kStart_min = 5, kMoreMemory = 1.5;
  constexpr double kBatch_mb = 100;  // the batch itself, a shell, files being written
  const std::size_t tasks = number_of_tasks(estimates, flags, threads);
  const auto largest = std::max_element(
      estimates.begin(), estimates.end(),
      [](const CaseEstimate& a, const CaseEstimate& b) { return a.memory_mb < b.memory_mb; });
  const double longest_min = longest_task_seconds(estimates, tasks, threads) / kSecondsPerMinute;
  return {.program = program_folder() / "organbake",
          .output = fs::absolute(flags.cases.output).lexically_normal(),
          .arguments = arguments_of(flags.cases),
          .tasks = tasks,
          .threads = threads,
          .memory_mb = kMoreMemory * largest->memory_mb + kBatch_mb,
          .minutes = kMoreTime * longest_min + kStart_min};
}

Json estimates_json(const std::vector<BatchCase>& cases,
                    const std::vector<CaseEstimate>& estimates) {
  Json list = Json::array();
  for (std::size_t i = 0; i < cases.size(); ++i) {
    list.push_back({{"case", cases[i].name},
                    {"cpu_seconds", estimates[i].cpu_seconds},
                    {"memory_mb", estimates[i].memory_mb},
                    {"flaw", estimates[i].flaw}});
  }
  return list;
}

void tell(const std::vector<BatchCase>& cases, const std::vector<CaseEstimate>& estimates,
          const JobPlan& plan, Terminal& terminal) {
  double seconds = 0, memory_mb = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    seconds += estimates[i].cpu_seconds;
    memory_mb = std::max(memory_mb, estimates[i].memory_mb);
    if (estimates[i].flaw.empty()) continue;
    terminal.log(LogLevel::warning, "case '" + cases[i].name + "' will fail: " + estimates[i].flaw);
  }
  terminal.log(LogLevel::info, "plan: " + std::to_string(cases.size()) + " cases in " +
                                   std::to_string(plan.tasks) + " tasks: about " +
                                   to_text(seconds, 0) + " s of one core in all, at most " +
                                   to_text(memory_mb, 0) + " MB a case");
  terminal.log(LogLevel::info, "plan: when all have ended: " + shell_word(plan.program.string()) +
                                   " batch -o " + shell_word(plan.output.string()) + " --gather " +
                                   std::to_string(plan.tasks));
}

std::string script_of(const JobPlan& plan, const std::string& engine) {
  if (engine == "snakemake") return job_snakefile(plan);
  return engine == "slurm" ? job_array(plan) : job_lines(plan);
}

}  // namespace

int run_plan(const Arguments& arguments, Session& session) {
  PlanFlags flags;
  const auto words = session.read_command(
      arguments, "plan CASES.csv|FILE…|PATTERN… --recipe RECIPE -o DIR --emit ENGINE [OPTIONS]",
      "Writes, for another engine to run, what 'organbake batch' would do: DIR/cases.csv with "
      "every case, and on stdout the commands of its tasks. Says first what time and memory they "
      "are thought to need, and refuses what can't fit.",
      plan_flag_list(flags), kMostCaseWords);
  if (!words) return 0;
  const std::vector<BatchCase> cases = read_cases(*words, flags.cases, "plan");
  const std::vector<CaseEstimate> estimates =
      estimates_of(cases, flags.cases, session.context("plan"));
  constexpr int kThreadsOfTask = 2;
  const int threads = session.threads() > 0 ? session.threads() : kThreadsOfTask;
  check_that_it_fits(cases, estimates, flags, threads);
  JobPlan plan = job_plan(estimates, flags, threads);
  if (flags.emit == "lines") plan.threads = session.threads();  // 0: all there are
  const std::string table = case_table_text(cases), script = script_of(plan, flags.emit);
  check_spares_tables(*words, plan.output / "cases.csv");
  make_batch_folder(plan.output);
  write_file_atomically(plan.output / "cases.csv", table);
  tell(cases, estimates, plan, session.terminal());
  session.print_result(script.substr(0, script.size() - 1),
                       {{"tasks", plan.tasks},
                        {"threads", plan.threads},
                        {"memory_mb", plan.memory_mb},
                        {"minutes", plan.minutes},
                        {"cases", estimates_json(cases, estimates)},
                        {"script", script}});
  return 0;
}

}  // namespace organbake
