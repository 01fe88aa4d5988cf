// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>

#include "report/run_report.h"

// A run as organbench.json (schema "bench") and back: nlohmann::json(report),
// json.get<RunReport>(). Of what is not valid JSON of that schema, get() throws
// nlohmann::json::exception.
namespace organbake {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Spread, median, least, most)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Timing, runs, wall_ms, cpu_ms, peak_mb)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Quantity, name, unit, value)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Point, task, subject, peer, knobs, timing, errors)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Picture, caption, width, height, data_uri)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SuiteResult::Skipped, what, why)
NLOHMANN_JSON_SERIALIZE_ENUM(Figure::Goal, {{Figure::Goal::at_most, "at most"},
                                            {Figure::Goal::at_least, "at least"}})
NLOHMANN_JSON_SERIALIZE_ENUM(Effort, {{Effort::quick, "quick"},
                                      {Effort::standard, "standard"},
                                      {Effort::thorough, "thorough"}})

inline void to_json(nlohmann::json& json, const Figure& f) {
  json = {{"what", f.what},     {"unit", f.unit}, {"value", f.value},
          {"target", f.target}, {"goal", f.goal}, {"met", f.met()}};
}
inline void from_json(const nlohmann::json& json, Figure& f) {
  f = {json.at("what"), json.at("unit"), json.at("value"), json.at("target"), json.at("goal")};
}

// Former runs had no pictures.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(SuiteResult, points, figures, skipped, pictures,
                                                failure)

inline void to_json(nlohmann::json& json, const RunReport::SuiteReport& suite) {
  json = suite.result;
  json.update({{"name", suite.name}, {"summary", suite.summary}, {"seconds", suite.seconds}});
}
inline void from_json(const nlohmann::json& json, RunReport::SuiteReport& suite) {
  suite = {json.at("name"), json.at("summary"), json.at("seconds"), json.get<SuiteResult>()};
}

inline void to_json(nlohmann::json& json, const RunReport& report) {
  json = {{"schema", "organbake/bench/1"},
          {"effort", report.effort},
          {"machine", report.machine},
          {"suites", report.suites}};
}
inline void from_json(const nlohmann::json& json, RunReport& report) {
  report = {json.at("effort"), json.at("machine").get<std::map<std::string, std::string>>(),
            json.at("suites").get<std::vector<RunReport::SuiteReport>>()};
}

}  // namespace organbake
