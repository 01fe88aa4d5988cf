// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench.h"

#include "organbake/pipelines/html_page.h"

namespace organbake {
namespace {

// A comparison whose rounds take seconds has few of them, or a run would take hours.
constexpr Rounds kRounds[] = {{.most = 1, .least = 1, .budget_s = 0.5},  // quick
                              {.most = 9, .least = 1, .budget_s = 2},    // standard
                              {.most = 9, .least = 3, .budget_s = 20}};  // thorough

}  // namespace

std::filesystem::path Bench::data(const std::string& relative_path) {
  const std::filesystem::path path = options_.data / relative_path;
  if (!options_.data.empty() && std::filesystem::exists(path)) return path;
  skip(relative_path, options_.data.empty() ? "no folder of real data was given (--data)"
                                            : options_.data.string() + " does not hold it");
  return {};
}

std::vector<Timing> Bench::time(const std::vector<std::function<void()>>& competitors) const {
  if (options_.rounds > 0) return time_in_turn(competitors, {options_.rounds, options_.rounds});
  return time_in_turn(competitors, kRounds[int(options_.effort)]);
}

void Bench::add(Point point) {
  result_.points.push_back(std::move(point));
  found_(result_);
}

void Bench::add(Figure figure) {
  result_.figures.push_back(std::move(figure));
  found_(result_);
}

void Bench::add(FailedCase failed) {
  result_.failed_cases.push_back(std::move(failed));
  found_(result_);
}

void Bench::show(const Rgb8Image& picture, const std::string& caption) {
  result_.pictures.push_back({caption, png_data_uri(picture), picture.width, picture.height});
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
