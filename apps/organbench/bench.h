// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "measuring/measurement.h"
#include "organbake/core/run_context.h"
#include "report/report.h"

namespace organbake {

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
