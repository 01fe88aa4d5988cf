// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "measuring/measurement.h"

// What one run found: as organbench.json, and as lines to read.
namespace organbake {

// What one suite found out.
struct SuiteResult {
  struct Skipped {
    std::string what, why;
  };

  std::vector<Point> points;
  std::vector<Figure> figures;
  std::vector<Skipped> skipped;
  std::string failure;  // why the suite ended early; empty when it did not
};

// All that one call of organbench found out.
struct RunReport {
  struct SuiteReport {
    std::string name, summary;
    double seconds = 0;
    SuiteResult result;
  };

  bool quick = false;
  std::map<std::string, std::string> machine;
  std::vector<SuiteReport> suites;
};

// A run as organbench.json (schema "bench"): nlohmann::json(report).
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Spread, median, least, most)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Timing, runs, wall_ms, cpu_ms, peak_mb)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Quantity, name, unit, value)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Point, task, subject, peer, knobs, timing, errors)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SuiteResult::Skipped, what, why)
NLOHMANN_JSON_SERIALIZE_ENUM(Figure::Goal, {{Figure::Goal::at_most, "at most"},
                                            {Figure::Goal::at_least, "at least"}})

inline void to_json(nlohmann::json& json, const Figure& f) {
  json = {{"what", f.what},     {"unit", f.unit}, {"value", f.value},
          {"target", f.target}, {"goal", f.goal}, {"met", f.met()}};
}
inline void to_json(nlohmann::json& json, const SuiteResult& r) {
  json = {
      {"points", r.points}, {"figures", r.figures}, {"skipped", r.skipped}, {"failure", r.failure}};
}

inline void to_json(nlohmann::json& json, const RunReport::SuiteReport& suite) {
  json = suite.result;
  json.update({{"name", suite.name}, {"summary", suite.summary}, {"seconds", suite.seconds}});
}
inline void to_json(nlohmann::json& json, const RunReport& report) {
  json = {{"schema", "organbake/bench/1"},
          {"effort", report.quick ? "quick" : "standard"},
          {"machine", report.machine},
          {"suites", report.suites}};
}
// Lines for people: what each who competes took, with its errors; figures beside their targets;
// what was left out.
std::string suite_text(const RunReport::SuiteReport& suite);

// What a reader must know to compare figures: processor, cores, memory, compiler, versions of the
// libraries that do the work or compete.
std::map<std::string, std::string> describe_machine();

}  // namespace organbake
