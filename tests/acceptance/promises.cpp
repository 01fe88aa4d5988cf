// SPDX-License-Identifier: GPL-3.0-or-later
#include "promises.h"

#include <cstdio>

#include "organbake/image/png.h"
#include "organbake/pipelines/documents.h"
#include "support/testing.h"

namespace organbake {
namespace {

void print(const std::string& what, const std::string& unit, double value,
           const std::string& goal) {
  const std::string text = page_number(value) + (unit.empty() ? "" : " " + unit);
  std::printf("[ figure   ] %s: %s%s\n", what.c_str(), text.c_str(), goal.c_str());
  std::fflush(stdout);  // whatever the next one ends as
  testing::Test::RecordProperty(what, text);
}

}  // namespace

void expect(const Figure& figure) {
  const bool at_most = figure.goal == Figure::Goal::at_most;
  print(figure.what, figure.unit, figure.value,
        (at_most ? " (at most " : " (at least ") + page_number(figure.target) + ")");
  if (at_most)
    EXPECT_LE(figure.value, figure.target) << figure.what << ", " << figure.unit;
  else
    EXPECT_GE(figure.value, figure.target) << figure.what << ", " << figure.unit;
}

void report(const std::string& what, const std::string& unit, double value) {
  print(what, unit, value, "");
}

int cases(int standard, int thorough) {
  return std::getenv("ORGANBAKE_THOROUGH") ? thorough : standard;
}

Seeds asked_seeds(int standard, int thorough) {
  const auto number = [](const char* name, int otherwise) {
    const char* text = std::getenv(name);
    return text ? std::strtoull(text, nullptr, 10) : static_cast<std::uint64_t>(otherwise);
  };
  return {number("ORGANBAKE_FIRST_CASE", 0), number("ORGANBAKE_CASES", cases(standard, thorough))};
}

void show(const Rgb8Image& picture, const std::string& name) {
  const char* folder = std::getenv("ORGANBAKE_PICTURES");
  if (!folder) return;
  std::filesystem::create_directories(folder);
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  write_png(std::filesystem::path(folder) / (std::string(test->name()) + " " + name + ".png"),
            picture);
}

}  // namespace organbake
