// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "measuring/measurement.h"
#include "organbake/core/run_context.h"
#include "organbake/image/channel_image.h"
#include "report/report.h"

namespace organbake {

struct BenchOptions {
  Effort effort = Effort::standard;
  int rounds = 0;                   // of every timing; 0 = as many as the effort allows
  int threads = 0;                  // 0 = all
  std::string only = {};            // the one measurement that is taken (Bench::wants); empty = all
  std::filesystem::path data = {};  // the folder of real data; suites do without what it lacks
  std::filesystem::path scratch = {};  // a folder for what a suite writes; goes away after it
};

// What a suite measures with, and where it leaves what it found.
class Bench {
 public:
  // `found` hears of the result after every addition.
  Bench(const BenchOptions& options, const RunContext& context,
        std::function<void(const SuiteResult&)> found)
      : options_(options), context_(context), found_(std::move(found)) {}

  bool quick() const { return options_.effort == Effort::quick; }
  bool thorough() const { return options_.effort == Effort::thorough; }
  // How many cases, steps or pixels.
  int count(int quick, int standard, int thorough) const {
    return std::array{quick, standard, thorough}[std::size_t(options_.effort)];
  }
  const BenchOptions& options() const { return options_; }
  const RunContext& context() const { return context_; }

  // Whether a measurement of this name was asked for; suites whose parts take long ask this.
  bool wants(const std::string& name) const {
    return options_.only.empty() || options_.only == name;
  }

  // A file or folder of the real data; empty, and said in the result, when it is not there.
  std::filesystem::path data(const std::string& relative_path);

  // A folder to write into, empty at first; it goes away after the suite, however that ends.
  const std::filesystem::path& scratch() const { return options_.scratch; }

  // For the line that tells a waiting person what is being measured.
  void now(const std::string& what) const { context_.info(what); }

  std::vector<Timing> time(const std::vector<std::function<void()>>& competitors) const;
  Timing time(const std::function<void()>& work) const { return time(std::vector{work}).front(); }

  // A point of ours, or of a peer on the same input; errors: the first is the one that is drawn.
  void point(const std::string& task, const std::string& subject, const Timing& timing,
             const Quantities& errors = {}, const Quantities& knobs = {});
  void peer(const std::string& task, const std::string& subject, const Timing& timing,
            const Quantities& errors = {}, const Quantities& knobs = {});
  void add(Point point);
  // What was promised, and what was measured.
  void at_most(const std::string& what, const std::string& unit, double value, double target);
  void at_least(const std::string& what, const std::string& unit, double value, double target);
  // The page takes every picture into itself: a suite shows one or two, some 1,000 pixels wide.
  void show(const Rgb8Image& picture, const std::string& caption);
  void skip(const std::string& what, const std::string& why);
  void fail(const std::string& why);

 private:
  template <class Item>
  void keep(std::vector<Item> SuiteResult::*list, Item item);

  const BenchOptions& options_;
  const RunContext& context_;
  std::function<void(const SuiteResult&)> found_;
  SuiteResult result_;
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

// Runs a suite in a process of its own, so that its memory is its own and its crash ends nothing
// else: `failure` then says what happened, and what was found until then is kept. Call it before
// this process starts threads. The same holds after Ctrl-C.
SuiteResult run_suite(const Suite& suite, const BenchOptions& options, const RunContext& context);

}  // namespace organbake
