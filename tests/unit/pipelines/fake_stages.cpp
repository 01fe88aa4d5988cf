// SPDX-License-Identifier: GPL-3.0-or-later
#include "fake_stages.h"

#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace fs = std::filesystem;

StageReport FakeStages::run(const Stage& stage, const StageCall& call) {
  calls_.push_back(stage.name);
  std::string text = stage.name + "\n" + call.options_json + "\n";
  for (const auto& [name, path] : call.inputs) {
    text += name + ": " + (fs::is_directory(path) ? "a folder" : read_text_file(path)) + "\n";
  }
  for (const StageOutput& output : stage.outputs) {
    const fs::path file =
        call.output_folder / (output.file == "." ? "cam_000/depth.exr" : output.file);
    fs::create_directories(file.parent_path());
    write_file_atomically(file, output.artifact + " of " + text);
    if (stage.name == failing_stage) throw BadDataError("this stage was told to fail");
  }
  if (stage.name == "capture") write_file_atomically(call.output_folder / "surface.ply", "colours");
  StageReport report;
  report.add("length", text.size());
  if (stage.name == warning_stage) call.context.warn(oddity);
  if (const auto* path = call.input(odd_input)) call.context.warn(path->string() + ": is odd");
  if (stage.name == warning_stage) report.quality_gate = "not good enough";
  report.skipped.push_back({"nothing", "a test"});
  return report;
}

Runner FakeStages::runner(const fs::path& cache_folder) {
  return {Cache(cache_folder),
          [this](const Stage& stage, const StageCall& call) { return run(stage, call); },
          [this](const std::string& stage, const Runner::Words& words) {
            return RunContext(
                [this, stage, words](LogLevel level, std::string_view text) {
                  const std::string told = words ? words(std::string(text)) : std::string(text);
                  if (level == LogLevel::warning && !told.empty())
                    heard.push_back(stage + ": " + told);
                },
                {}, nullptr);
          }};
}

std::string FakeStages::take_calls() {
  std::string all;
  for (const std::string& name : calls_) all += (all.empty() ? "" : " ") + name;
  calls_.clear();
  return all;
}

Recipe recipe_from(const fs::path& folder, const std::string& yaml,
                   const std::vector<std::string>& settings) {
  write_file_atomically(folder / "recipe.yaml", yaml);
  return read_recipe(folder / "recipe.yaml", settings);
}

}  // namespace organbake
