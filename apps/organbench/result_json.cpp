// SPDX-License-Identifier: GPL-3.0-or-later
#include "result_json.h"

#include <nlohmann/json.hpp>

namespace organbake {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Spread& s) {
  return {{"median", s.median}, {"least", s.least}, {"most", s.most}};
}

Json to_json(const std::vector<Quantity>& quantities) {
  Json list = Json::array();
  for (const Quantity& q : quantities) {
    list.push_back({{"name", q.name}, {"unit", q.unit}, {"value", q.value}});
  }
  return list;
}

Json to_json(const Point& p) {
  return {{"task", p.task},
          {"subject", p.subject},
          {"peer", p.peer},
          {"knobs", to_json(p.knobs)},
          {"timing",
           {{"runs", p.timing.runs},
            {"wall_ms", to_json(p.timing.wall_ms)},
            {"cpu_ms", to_json(p.timing.cpu_ms)},
            {"peak_mb", p.timing.peak_mb}}},
          {"errors", to_json(p.errors)}};
}

Json to_json(const Figure& f) {
  return {{"what", f.what},
          {"unit", f.unit},
          {"value", f.value},
          {"target", f.target},
          {"goal", f.goal == Figure::Goal::at_most ? "at most" : "at least"},
          {"met", f.met()}};
}

Spread spread_from(const Json& json) {
  return {json.at("median").get<double>(), json.at("least").get<double>(),
          json.at("most").get<double>()};
}

std::vector<Quantity> quantities_from(const Json& json) {
  std::vector<Quantity> list;
  for (const Json& q : json) {
    list.push_back({q.at("name").get<std::string>(), q.at("unit").get<std::string>(),
                    q.at("value").get<double>()});
  }
  return list;
}

Point point_from(const Json& json) {
  const Json& timing = json.at("timing");
  return {json.at("task").get<std::string>(),
          json.at("subject").get<std::string>(),
          json.at("peer").get<bool>(),
          quantities_from(json.at("knobs")),
          {timing.at("runs").get<int>(), spread_from(timing.at("wall_ms")),
           spread_from(timing.at("cpu_ms")), timing.at("peak_mb").get<double>()},
          quantities_from(json.at("errors"))};
}

Figure figure_from(const Json& json) {
  return {json.at("what").get<std::string>(), json.at("unit").get<std::string>(),
          json.at("value").get<double>(), json.at("target").get<double>(),
          json.at("goal") == "at most" ? Figure::Goal::at_most : Figure::Goal::at_least};
}

}  // namespace

Json to_json(const SuiteResult& result) {
  Json points = Json::array(), figures = Json::array(), skipped = Json::array();
  for (const Point& p : result.points) points.push_back(to_json(p));
  for (const Figure& f : result.figures) figures.push_back(to_json(f));
  for (const auto& s : result.skipped) skipped.push_back({{"what", s.what}, {"why", s.why}});
  Json failed = Json::array();
  for (const FailedCase& c : result.failed_cases) {
    failed.push_back(
        {{"seed", c.seed}, {"stage", c.stage}, {"outcome", c.outcome}, {"message", c.message}});
  }
  Json pictures = Json::array();
  for (const Picture& p : result.pictures) {
    pictures.push_back({{"caption", p.caption},
                        {"width", p.width},
                        {"height", p.height},
                        {"data_uri", p.data_uri}});
  }
  return {{"points", points},       {"figures", figures},   {"skipped", skipped},
          {"failed_cases", failed}, {"pictures", pictures}, {"failure", result.failure}};
}

SuiteResult suite_result_from_json(const Json& json) {
  SuiteResult result;
  for (const Json& p : json.at("points")) result.points.push_back(point_from(p));
  for (const Json& f : json.at("figures")) result.figures.push_back(figure_from(f));
  for (const Json& s : json.at("skipped")) {
    result.skipped.push_back({s.at("what").get<std::string>(), s.at("why").get<std::string>()});
  }
  for (const Json& c : json.at("failed_cases")) {
    result.failed_cases.push_back(
        {c.at("seed").get<std::uint64_t>(), c.at("stage").get<std::string>(),
         c.at("outcome").get<std::string>(), c.at("message").get<std::string>()});
  }
  for (const Json& p : json.value("pictures", Json::array())) {  // former runs had none
    result.pictures.push_back({p.at("caption").get<std::string>(),
                               p.at("data_uri").get<std::string>(), p.at("width").get<int>(),
                               p.at("height").get<int>()});
  }
  result.failure = json.at("failure").get<std::string>();
  return result;
}

}  // namespace organbake
