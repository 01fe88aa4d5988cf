// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/batch_cases.h"
#include "organbake/pipelines/case_estimate.h"

namespace organbake {

inline constexpr std::size_t kMostCaseWords = 1'000'000;

// What `batch` and `plan` are told about the cases alike.
struct CaseFlags {
  std::filesystem::path recipe, output, cache;
  std::string input = "ct";
  std::vector<std::string> settings;
  bool pictures = true, web = false, strict = false;
  double memory_mb = 0;
};
void add_case_flags(OptionList& list, CaseFlags& flags);

// The cases that the words name. Throws UsageError for what is missing: words, --recipe or -o.
std::vector<BatchCase> read_cases(const std::vector<std::string>& words, CaseFlags& flags,
                                  const std::string& command);
// What each is thought to need.
std::vector<CaseEstimate> estimates_of(const std::vector<BatchCase>& cases, const CaseFlags& flags,
                                       const RunContext& context);

// Creates the batch's folder with its logs. Throws IoError, also for a bundle's folder, which other
// files would damage.
void make_batch_folder(const std::filesystem::path& folder);
// Throws IoError when a table of cases among the words would be overwritten by `file`.
void check_spares_tables(const std::vector<std::string>& words, const std::filesystem::path& file);

}  // namespace organbake
