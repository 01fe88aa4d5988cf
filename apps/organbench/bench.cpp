// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbench/bench.h"

namespace organbake {
namespace {

constexpr int kRounds = 9, kQuickRounds = 2;

}  // namespace

std::filesystem::path Bench::data(const std::string& relative_path) {
  const std::filesystem::path path = options_.data / relative_path;
  if (!options_.data.empty() && std::filesystem::exists(path)) return path;
  skip(relative_path, options_.data.empty() ? "no folder of real data was given (--data)"
                                            : options_.data.string() + " does not hold it");
  return {};
}

std::vector<Timing> Bench::time(const std::vector<std::function<void()>>& competitors) const {
  const int rounds = options_.rounds > 0 ? options_.rounds : quick() ? kQuickRounds : kRounds;
  return time_in_turn(competitors, rounds);
}

void Bench::add(Point point) {
  result_.points.push_back(std::move(point));
  found_(result_);
}

void Bench::add(Figure figure) {
  result_.figures.push_back(std::move(figure));
  found_(result_);
}

void Bench::skip(const std::string& what, const std::string& why) {
  result_.skipped.push_back({what, why});
  found_(result_);
}

void Bench::fail(const std::string& why) {
  result_.failure = why;
  found_(result_);
}

}  // namespace organbake
