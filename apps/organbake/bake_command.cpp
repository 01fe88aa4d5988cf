// SPDX-License-Identifier: GPL-3.0-or-later
// organbake bake, report and export: what makes a bundle, tells about it, and writes it for others.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "organbake/bundle/breath.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/bake_report.h"
#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/cache.h"
#include "organbake/pipelines/export_options.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/runner.h"
#include "organbake/pipelines/stage.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

struct BakeFlags {
  fs::path output, cache;
  std::string to, quality, repair, unit, space;
  std::vector<std::string> settings;
  bool force = false, dry_run = false, explain = false, strict = false, report = true, web = false;
};

OptionList flag_list(BakeFlags& flags) {
  std::vector<std::string> stages;
  for (const Stage& stage : all_stages()) stages.push_back(stage.name);
  OptionList list;
  list.add("output", &flags.output,
           {.help = "the bundle's folder", .value = "DIR", .short_flag = "-o"})
      .add("set", &flags.settings,
           {.help = "repeatable: an input (ct=scan.nii.gz) or an option (decimate.faces=100)",
            .value = "KEY=VALUE"})
      .add("repair", &flags.repair,
           {.help = "a surface that is given is made fit first; as --set repair.mode=",
            .choices = {"auto", "none"}})
      .add("unit", &flags.unit, {.help = "of a surface that is given; as --set unit="})
      .add("space", &flags.space, {.help = "axes of a surface that is given; as --set space="})
      .add("quality", &flags.quality,
           {.help = "sets the options that trade time for error where neither the recipe nor --set "
                    "does; --explain shows them",
            .choices = quality_names()})
      .add("to", &flags.to,
           {.help = "stop after this stage; -o gets what it made", .choices = stages})
      .add("force", &flags.force, {.help = "run every stage, whatever the cache holds"})
      .retire("from", "force runs every stage")
      .add("dry_run", &flags.dry_run, {.help = "only tell what would run"})
      .add("explain", &flags.explain,
           {.help = "tell what each step depends on, why it runs or not"})
      .add("strict", &flags.strict,
           {.help = "end with exit code 3 when a stage warned of something; the bundle is written"})
      .add("report", &flags.report,
           {.help = "write a page about the bundle beside it, BUNDLE_report.html"})
      .add("web", &flags.web,
           {.help = "write a page beside the bundle in which anyone can poke it, "
                    "BUNDLE_player.html; the report links to it"})
      .add("cache", &flags.cache, {.help = "folder of the cache", .value = "DIR"});
  return list;
}

void tell_left_out(const Plan& plan, Terminal& terminal) {
  for (const LeftOut& item : plan.left_out) {
    terminal.log(LogLevel::info, item.what + ": left out, " + item.why);
  }
}

void tell_report(const StepResult& step, Terminal& terminal) {
  const Json report = Json::parse(step.entry.record.report_json);
  if (const std::string damage = report.value("bad_data", ""); !damage.empty())
    terminal.log(LogLevel::warning,
                 step.step->stage->name + ": " + in_bake_words(step.step->stage->name, damage));
  if (!step.ran) return;
  for (const Json& item : report.at("skipped")) {
    terminal.log(LogLevel::debug, step.step->stage->name +
                                      ": skipped: " + item.at("what").get<std::string>() + ", " +
                                      item.at("why").get<std::string>());
  }
}

void tell(const StepResult& step, Terminal& terminal) {
  terminal.log(
      LogLevel::info,
      step.step->stage->name + ": " +
          (step.ran ? "ran in " + to_text(step.entry.record.seconds, 2) + " s" : "cached"));
  tell_report(step, terminal);
}

int show_plan(const Plan& plan, const std::vector<Forecast>& forecasts, bool explain,
              Session& session) {
  std::string text;
  Json steps = Json::array();
  for (const Forecast& forecast : forecasts) {
    const std::string state = forecast.cached ? "cached" : "to run";
    std::vector<std::string> lines = {forecast.step->stage->name + ": " + state};
    if (explain) lines = explanation(forecast);
    for (const std::string& line : lines) text += line + "\n";
    steps.push_back(
        {{"stage", forecast.step->stage->name}, {"state", state}, {"why", forecast.why}});
  }
  for (const LeftOut& item : plan.left_out) text += item.what + ": left out, " + item.why + "\n";
  text.pop_back();
  session.print_result(text, {{"stages", steps}, {"left_out", left_out_json(plan.left_out)}});
  return 0;
}

Json result_json(const BakeFlags& flags, const std::vector<StepResult>& steps, const Plan& plan,
                 const std::string& state) {
  Json stages = Json::array();
  for (const StepResult& step : steps) {
    stages.push_back({{"stage", step.step->stage->name},
                      {"state", step.ran ? "ran" : "cached"},
                      {"key", step.entry.ingredients.key()},
                      {"seconds", step.ran ? step.entry.record.seconds : 0}});
  }
  return {{"output", flags.output.string()},
          {"state", state},
          {"stages", stages},
          {"warnings", warnings_of(steps)},
          {"left_out", left_out_json(plan.left_out)}};
}

StepListener listener(const BakeFlags& flags, Terminal& terminal) {
  StepListener listener;
  listener.after = [&](const StepResult& step) { tell(step, terminal); };
  if (flags.explain) {
    listener.before = [&](const Forecast& forecast) {
      for (const std::string& line : explanation(forecast)) terminal.log(LogLevel::info, line);
    };
  }
  return listener;
}

// Where a stage declines, what else makes the same takes its place.
std::vector<StepResult> run_open_stages(Recipe& recipe, Plan& plan, Runner& runner,
                                        const RunOptions& options, const BakeFlags& flags,
                                        Terminal& terminal) {
  while (true) {
    std::vector<StepResult> steps = runner.run(plan, options, listener(flags, terminal));
    if (steps.empty() || steps.back().declined().empty()) return steps;
    const std::string stage = steps.back().step->stage->name;
    const std::string why = in_bake_words(stage, steps.back().declined());
    terminal.log(LogLevel::warning, stage + ": " + why + "; the bake goes on without it");
    recipe.declined[stage] = why;
    steps.clear();
    plan = plan_bake(recipe, flags.to);
  }
}

// Puts the result where -o says; returns what became of it.
std::string write_result(const BakeFlags& flags, const Recipe& recipe, const Plan& plan,
                         std::vector<StepResult>& steps, Runner& runner) {
  if (flags.to.empty()) {
    const BundleWritten written = write_bundle({recipe, plan, steps}, runner, flags.output);
    return written == BundleWritten::unchanged ? "unchanged" : "written";
  }
  runner.ensure_sound(steps, steps.size() - 1);
  write_stage_outputs(steps.back(), flags.output);
  return "written";
}

SaidWarnings said_of(const std::vector<StepResult>& steps) {
  SaidWarnings said;
  for (const StepResult& step : steps) said[step.step->stage->name] = step.warnings;
  return said;
}

// Writes what a bundle is exported to: a folder, or of the format `web` the page itself. The
// formats' libraries are heavy, so a module does it.
void write_export(const fs::path& bundle, const ExportOptions& options, const fs::path& output,
                  Session& session) {
  const bool is_page = options.format == ExportFormat::web;
  is_page ? check_output_file(output, ".html") : check_output_folder(output);
  if (!fs::exists(bundle)) throw NoInputError(bundle, "there is no such file or folder");
  AtomicFolder folder(output);
  const Stage stage{.name = "export"};
  const RunContext context = session.context(stage.name);
  context.progress(0);
  const StageReport report =
      run_in_module(stage, {&options, {}, {{"bundle", bundle}}, folder.path(), context});
  context.progress(1);
  if (is_page) return write_file_atomically(output, read_file(folder.path() / kWebPageFile));
  std::vector<std::string> files;
  for (const fs::path& file : list_files(folder.path())) files.push_back(file.generic_string());
  write_file_atomically(folder.path() / "report.json",
                        folder_report(stage_report_json(stage, report), files));
  folder.commit();
}

// A bundle that a bake left alone keeps the page of the bake that made it.
void write_page(const BakeFlags& flags, const SaidWarnings& said, bool unchanged) {
  const BundleReader reader(flags.output);
  const fs::path page = page_beside(flags.output);
  if (unchanged && !flags.web && is_page_of(page, reader)) return;
  const bool has_player = flags.web || fs::exists(player_page_beside(flags.output));
  const std::string player = has_player ? player_link(flags.output, page) : "";
  write_file_atomically(page, bundle_page(reader, said, player));
}

// Pages that this bake leaves alone, one that was killed may have begun.
void sweep_pages(const fs::path& bundle) {
  AtomicFolder::sweep(page_beside(bundle));
  AtomicFolder::sweep(player_page_beside(bundle));
}

// Those that were asked for.
void write_pages(const BakeFlags& flags, const SaidWarnings& said, const std::string& state,
                 Session& session) {
  const bool unchanged = state == "unchanged";
  sweep_pages(flags.output);
  if (flags.report) write_page(flags, said, unchanged);
  const fs::path player = player_page_beside(flags.output);
  if (!flags.web || (unchanged && fs::exists(player))) return;
  ExportOptions page;
  page.format = ExportFormat::web;
  write_export(flags.output, page, player, session);
}

// What is there may be replaced by another bake while it is looked at.
void check_target(const BakeFlags& flags, const Plan& plan, const RunContext& context) {
  std::optional<FileLock> lock;
  if (fs::exists(flags.output)) lock.emplace(output_lock(flags.output), context);
  flags.to.empty() ? check_output_folder(flags.output)
                   : check_stage_target(*plan.steps.back().stage, flags.output);
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::size_t count_ran(const std::vector<StepResult>& steps) {
  return static_cast<std::size_t>(
      std::count_if(steps.begin(), steps.end(), [](const StepResult& step) { return step.ran; }));
}

// What was made, how long it took, and what comes next.
void tell_end(const BakeFlags& flags, const std::vector<StepResult>& steps,
              const std::string& state, double seconds, Terminal& terminal) {
  const std::string output = flags.output.string();
  std::string text = output + ": " + state + "; " + std::to_string(count_ran(steps)) + " of " +
                     std::to_string(steps.size()) + " stages ran; " + to_text(seconds, 1) + " s";
  if (flags.to.empty()) text += ". To play it: organplay " + shell_word(output);
  const fs::path breath = flags.output / kBreathFile;
  if (flags.to.empty() && fs::exists(breath))
    text += ", or, breathing as in the clip, with --script " + shell_word(breath.string()) +
            " --video breath.mp4";
  terminal.log(LogLevel::info, text);
}

}  // namespace

int run_bake(const Arguments& arguments, Session& session) {
  BakeFlags flags;
  const auto words = session.read_command(
      arguments, "bake RECIPE -o BUNDLE [--set KEY=VALUE]… [OPTIONS]",
      "Runs a recipe, a file or one of 'organbake recipes' by name: every stage that its scene "
      "needs and the cache doesn't hold already.",
      flag_list(flags), 1, "a recipe, such as liver; 'organbake recipes' lists them");
  if (!words) return 0;
  if (flags.output.empty() && !flags.dry_run) {
    throw UsageError("-o is missing: where shall the bundle go?");
  }
  if (!flags.repair.empty()) flags.settings.push_back("repair.mode=" + flags.repair);
  if (!flags.unit.empty()) flags.settings.push_back("unit=" + flags.unit);
  if (!flags.space.empty()) flags.settings.push_back("space=" + flags.space);
  if (!flags.quality.empty()) flags.settings.push_back("quality=" + flags.quality);
  Recipe recipe = read_recipe(recipe_file(words->front()), flags.settings);
  for (const std::string& note : recipe.notes) session.terminal().log(LogLevel::info, note);
  Plan plan = plan_bake(recipe, flags.to);
  Runner runner = session.runner(flags.cache);
  const RunOptions options{flags.force, flags.explain, flags.to.empty()};
  if (flags.dry_run) return show_plan(plan, runner.forecast(plan, options), flags.explain, session);

  check_target(flags, plan, session.context("bake"));
  const Clock::time_point start = Clock::now();
  Terminal& terminal = session.terminal();
  tell_left_out(plan, terminal);
  std::vector<StepResult> steps = run_open_stages(recipe, plan, runner, options, flags, terminal);
  const RunContext writing = session.context("bundle");
  writing.progress(0);
  const FileLock lock(output_lock(flags.output), session.context("bake"));
  const std::string state = write_result(flags, recipe, plan, steps, runner);
  if (flags.to.empty()) write_pages(flags, said_of(steps), state, session);
  writing.progress(1);
  tell_end(flags, steps, state, seconds_since(start), terminal);
  session.print_result(flags.output.string(), result_json(flags, steps, plan, state));
  return flags.strict && !warnings_of(steps).empty() ? static_cast<int>(ExitCode::quality_gate) : 0;
}

int run_report(const Arguments& arguments, Session& session) {
  fs::path output;
  OptionList options;
  options.add("output", &output,
              {.help = "the page; else BUNDLE_report.html beside the bundle",
               .value = "FILE",
               .short_flag = "-o"});
  const auto words = session.read_command(
      arguments, "report BUNDLE [-o PAGE.html]",
      "Writes one page about a bundle: warnings, pictures, errors, and what was skipped and why.",
      options, 1, "a bundle");
  if (!words) return 0;
  const BundleReader reader(words->front());
  const fs::path beside = page_beside(words->front());
  if (output.empty()) output = beside;
  check_output_file(output, ".html");
  const bool has_player = fs::exists(player_page_beside(words->front()));
  const std::string player = has_player ? player_link(words->front(), output) : "";
  write_file_atomically(output, bundle_page(reader, {}, player));
  session.print_result(output.string(), {{"output", output.string()}});
  return 0;
}

int run_export(const Arguments& arguments, Session& session) {
  ExportOptions asked;
  fs::path output;
  OptionList options, own;
  bind(own, asked);
  options
      .add("output", &output, {.help = "the folder to write; of web: the page", .short_flag = "-o"})
      .append(own);
  const auto words =
      session.read_command(arguments, "export BUNDLE --format FORMAT -o OUTPUT",
                           "Writes a bundle's surface, cameras and pictures for other programs.",
                           options, 1, "a bundle");
  if (!words) return 0;
  if (output.empty()) throw UsageError("-o is missing: where shall the export go?");
  write_export(words->front(), asked, output, session);
  session.print_result(output.string(), {{"output", output.string()}});
  return 0;
}

}  // namespace organbake
