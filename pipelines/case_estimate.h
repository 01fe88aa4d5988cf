// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

// What a bake is thought to need, before it starts. Meant to be rather too much than too little.
struct CaseEstimate {
  double cpu_seconds = 0;  // of one core
  double memory_mb = 0;
  std::string flaw;  // why nothing can be told: the bake will fail for the same reason
};

// By the sizes of the inputs and the options that cost time, with constants that were measured
// (case_estimate.cpp). Reads headers, not contents; never throws for what is wrong with a case.
CaseEstimate estimate_case(const std::filesystem::path& recipe,
                           const std::vector<std::string>& settings);

}  // namespace organbake
