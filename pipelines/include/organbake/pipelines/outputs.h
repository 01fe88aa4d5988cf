// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "organbake/pipelines/plan.h"
#include "organbake/pipelines/runner.h"

namespace organbake {

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
nlohmann::json left_out_json(const Plan& plan);

}  // namespace organbake
