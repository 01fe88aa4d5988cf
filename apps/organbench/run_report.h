// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bench.h"

namespace organbake {

// All that one call of organbench found out.
struct RunReport {
  struct SuiteReport {
    std::string name, summary;
    double seconds = 0;
    SuiteResult result;
  };

  Effort effort = Effort::standard;
  std::vector<std::pair<std::string, std::string>> machine;
  std::vector<SuiteReport> suites;
};

nlohmann::ordered_json to_json(const RunReport& report);  // organbench.json
RunReport run_report_from_json(const nlohmann::ordered_json& json);

// One page for people: figures beside their targets, curves, tables; no network.
std::string report_page(const RunReport& report);

}  // namespace organbake
