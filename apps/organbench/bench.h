// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What a run measures and finds (as organbench.json, and as lines to read), and the suites that do.

#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"

namespace organbake {

// Of one quantity over several runs.
struct Spread {
  double median = 0, least = 0, most = 0;
};
Spread spread_of(std::vector<double> values);  // at least one value

// What it costs to do something once.
struct Timing {
  int runs = 0;
  Spread wall_ms;
  Spread cpu_ms;       // of all threads and of the programs that were run, together
  double peak_mb = 0;  // most resident memory beyond what was resident before; of the first run
};

struct Quantity {
  std::string name, unit;
  double value = 0;
};
using Quantities = std::vector<Quantity>;

// One point of a curve: what `subject` took for `task` with its knobs set so, and how wrong it was.
struct Point {
  std::string task;     // the same for all that compete: "phantom, 81,920 faces → 80"
  std::string subject;  // "organbake fitted", "CGAL Lindstrom–Turk"
  bool peer = false;    // not ours
  Quantities knobs;
  Timing timing;
  Quantities errors;  // the first is the one that is drawn
};

// A number that was promised, beside what was measured.
struct Figure {
  enum class Goal { at_most, at_least };

  std::string what;
  std::string unit;
  double value = 0;
  double target = 0;
  Goal goal = Goal::at_most;

  bool met() const { return goal == Goal::at_most ? value <= target : value >= target; }
};

struct Rounds {
  int most = 9;
  int least = 9;        // however long they take
  double budget_s = 0;  // no further round is begun after it
};

// Does the work of all competitors in turn, round after round, so that whatever else the machine
// does falls on each of them alike. A round before the first warms caches up and is not counted,
// unless it took the whole budget and one is enough.
std::vector<Timing> time_in_turn(const std::vector<std::function<void()>>& competitors,
                                 const Rounds& rounds);

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

struct BenchOptions {
  bool quick = false;                  // small inputs, one round: a first look
  int rounds = 0;                      // of every timing; 0 = 9, or as many as 2 s allow
  int threads = 0;                     // 0 = all
  std::filesystem::path data = {};     // the folder of real data; suites do without what it lacks
  std::filesystem::path scratch = {};  // a folder for what a suite writes; goes away after it
};

// What a suite measures with, and where it leaves what it found.
class Bench {
 public:
  Bench(const BenchOptions& options, const RunContext& context, SuiteResult& result)
      : options_(options), context_(context), result_(result) {}

  bool quick() const { return options_.quick; }
  // How many cases, steps or pixels.
  int count(int quick, int usual) const { return options_.quick ? quick : usual; }
  const BenchOptions& options() const { return options_; }
  const RunContext& context() const { return context_; }

  // A file or folder of the real data; empty, and said in the result, when it is not there.
  std::filesystem::path data(const std::string& relative_path);

  // A folder to write into, empty at first; it goes away after the suite, however that ends.
  const std::filesystem::path& scratch() const { return options_.scratch; }

  // For the line that tells a waiting person what is being measured.
  void now(const std::string& what) const { context_.info(what); }

  // Throws CancelledError between two runs when it was asked to stop.
  std::vector<Timing> time(const std::vector<std::function<void()>>& competitors) const;
  Timing time(const std::function<void()>& work) const { return time(std::vector{work}).front(); }

  // A point of ours; add() takes those of peers on the same input, too.
  void point(const std::string& task, const std::string& subject, const Timing& timing,
             const Quantities& errors = {}, const Quantities& knobs = {});
  void add(Point point);
  // What was promised, and what was measured.
  void at_most(const std::string& what, const std::string& unit, double value, double target);
  void at_least(const std::string& what, const std::string& unit, double value, double target);
  void skip(const std::string& what, const std::string& why);
  void fail(const std::string& why);

 private:
  const BenchOptions& options_;
  const RunContext& context_;
  SuiteResult& result_;
};

// A suite sweeps knobs that trade time for error, with peers on the same input in the same run, and
// adds a figure for every promise.
struct Suite {
  std::string name, summary;
  std::vector<void (*)(Bench&)> parts;
};

// A part of a suite is one file of suites/, which has one of these, constant and in its unnamed
// namespace; one of a suite's parts gives its summary.
struct RegisteredPart {
  RegisteredPart(const std::string& suite, void (*run)(Bench&), const std::string& summary = {});
};
// In the order of their names.
std::vector<Suite> all_suites();

// What it throws, and Ctrl-C, end it early: `failure` then says why, and what was found until then
// is kept.
SuiteResult run_suite(const Suite& suite, const BenchOptions& options, const RunContext& context);

}  // namespace organbake
