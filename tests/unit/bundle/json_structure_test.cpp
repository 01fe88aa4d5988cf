// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/json_structure.h"

#include <gtest/gtest.h>

#include <string>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

TEST(JsonStructure, RefusesKeysThatAreThereTwice) {
  EXPECT_NO_THROW(check_json_structure(R"({"a": {"b": 1}, "b": [{"b": 2}, {"b": 3}]})", "d.json"));
  for (const char* text : {R"({"a": 1, "b": 2, "a": 3})", R"([0, {"c": {"a": 1, "a": 1}}])"})
    EXPECT_THROW(check_json_structure(text, "d.json"), BadDataError) << text;
}

TEST(JsonStructure, RefusesWhatIsNestedTooDeeply) {
  const auto nested = [](std::size_t depth) {
    return std::string(depth, '[') + std::string(depth, ']');
  };
  EXPECT_NO_THROW(check_json_structure(nested(100), "d.json"));
  for (const std::size_t depth : {101u, 1'000'000u})
    EXPECT_THROW(check_json_structure(nested(depth), "d.json"), BadDataError) << depth;
}

TEST(JsonStructure, LeavesWhatIsNoJsonToReading) {
  for (const char* text : {"", "{", "[1, 2", "{\"a\" 1}", "\xff", "1e999"}) {
    EXPECT_NO_THROW(check_json_structure(text, "d.json")) << text;
    EXPECT_THROW(parse_json(text, "d.json"), BadDataError) << text;
  }
}

// A parser that asked about each value took the square of an array's length: minutes for this one.
TEST(JsonStructure, LongArraysAreReadAtOnce) {
  std::string text = "[{}";
  for (int i = 0; i < 200'000; ++i) text += ",{}";
  EXPECT_EQ(parse_json(text + "]", "long.json").size(), 200'001u);
}

}  // namespace
}  // namespace organbake
