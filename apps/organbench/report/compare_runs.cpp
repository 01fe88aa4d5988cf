// SPDX-License-Identifier: GPL-3.0-or-later
// What became better or worse from one run to the next.
#include "report/report.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace organbake {
namespace {

constexpr double kTimeNoise = 0.05, kErrorNoise = 0.01;

using Kind = Change::Kind;

Kind kind_of(double before, double after, double noise) {
  if (std::abs(after - before) <= noise * std::abs(before)) return Kind::same;
  return after < before ? Kind::better : Kind::worse;
}

Change time_change(const std::string& what, const Spread& before, const Spread& after) {
  Change change{what + ", ms", before.median, after.median, Kind::same};
  const bool apart = before.most < after.least || after.most < before.least;
  if (apart) change.kind = kind_of(before.median, after.median, kTimeNoise);
  return change;
}

std::map<std::string, const Point*> points_of(const RunReport& run) {
  std::map<std::string, const Point*> points;
  for (const auto& suite : run.suites) {
    for (const Point& p : suite.result.points) {
      std::string key = suite.name + ": " + p.task + ": " + p.subject;
      for (const Quantity& knob : p.knobs) {
        // What is asked for names the point; a count that comes out, like faces, may differ.
        if (!knob.unit.empty()) key += ", " + knob.name + " " + std::to_string(knob.value);
      }
      points.emplace(key, &p);
    }
  }
  return points;
}

}  // namespace

bool Comparison::regressed() const {
  return std::any_of(changes.begin(), changes.end(),
                     [](const Change& c) { return c.kind == Kind::worse; });
}

Comparison compare_runs(const RunReport& before, const RunReport& after) {
  const auto old_points = points_of(before), new_points = points_of(after);
  Comparison comparison;
  for (const auto& [key, p] : old_points) {
    const auto found = new_points.find(key);
    if (found == new_points.end()) {
      comparison.only_one.push_back(key + " (gone)");
      continue;
    }
    const Point& q = *found->second;
    if (p->peer) continue;  // the peers are there to compare with, not to be watched
    comparison.changes.push_back(time_change(key, p->timing.wall_ms, q.timing.wall_ms));
    if (!p->errors.empty()) {
      const double a = p->errors.front().value, b = q.errors.at(0).value;
      comparison.changes.push_back(
          {key + ", " + p->errors.front().name, a, b, kind_of(a, b, kErrorNoise)});
    }
  }
  for (const auto& [key, p] : new_points) {
    if (!old_points.count(key)) comparison.only_one.push_back(key + " (new)");
  }
  return comparison;
}

}  // namespace organbake
