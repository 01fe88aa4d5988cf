// SPDX-License-Identifier: GPL-3.0-or-later
#include "run_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "result_json.h"

namespace organbake {

using Json = nlohmann::ordered_json;

namespace {

constexpr const char* kEfforts[] = {"quick", "standard", "thorough"};

Effort effort_named(const std::string& name) {
  return Effort(std::find(std::begin(kEfforts), std::end(kEfforts) - 1, name) -
                std::begin(kEfforts));
}

}  // namespace

Json to_json(const RunReport& report) {
  Json machine = Json::object(), suites = Json::array();
  for (const auto& [key, value] : report.machine) machine[key] = value;
  for (const RunReport::SuiteReport& s : report.suites) {
    Json suite = {{"name", s.name}, {"summary", s.summary}, {"seconds", s.seconds}};
    suite.update(to_json(s.result));
    suites.push_back(suite);
  }
  return {{"schema", "organbake/bench/1"},
          {"effort", kEfforts[int(report.effort)]},
          {"machine", machine},
          {"suites", suites}};
}

RunReport run_report_from_json(const Json& json) {
  RunReport report;
  report.effort = effort_named(json.at("effort").get<std::string>());
  for (const auto& [key, value] : json.at("machine").items()) {
    report.machine.emplace_back(key, value.get<std::string>());
  }
  for (const Json& s : json.at("suites")) {
    report.suites.push_back({s.at("name").get<std::string>(), s.at("summary").get<std::string>(),
                             s.at("seconds").get<double>(), suite_result_from_json(s)});
  }
  return report;
}

}  // namespace organbake
