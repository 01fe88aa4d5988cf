// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/pipelines/schema_check.h"

namespace organbake {
namespace {

using nlohmann::json;
using testing::HasSubstr;

template <class Error>
std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

std::string yaml_error(const std::string& text) {
  return message_of<RecipeError>([&] { Document::parse_yaml(text, "r.yaml"); });
}

TEST(Document, YamlScalarsHaveTheTypesOfTheCoreSchema) {
  const Document document = Document::parse_yaml(
      "a: 3\nb: 0.5\nc: true\nd: text\ne: '3'\nf: [1, 2]\ng:\nh: -1e3\ni: 12abc\n", "r.yaml");
  EXPECT_EQ(document.json(), json::parse(R"({"a": 3, "b": 0.5, "c": true, "d": "text", "e": "3",
      "f": [1, 2], "g": null, "h": -1000.0, "i": "12abc"})"));
}

TEST(Document, ErrorsOfYamlNameTheLine) {
  EXPECT_THAT(yaml_error("a: 1\nb: [1, 2\n"), HasSubstr("r.yaml:"));
  EXPECT_EQ(yaml_error("a: 1\nb: 2\na: 3\n"), "r.yaml:3: 'a' is there twice");
  EXPECT_THAT(yaml_error("a: 1\n? [x]\n: 2\n"), HasSubstr("r.yaml:2: a key must be"));
}

TEST(Document, AFewLinesCannotBecomeMillionsOfValues) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    const std::string before = "*a" + std::to_string(i - 1), name = "a" + std::to_string(i);
    bomb +=
        name + ": &" + name + " [" + before + ", " + before + ", " + before + ", " + before + "]\n";
  }
  EXPECT_THAT(yaml_error(bomb), HasSubstr("too many values"));
}

TEST(Document, NestingWithoutEndIsRefused) {
  const std::string deep(1000000, '[');
  EXPECT_THAT(message_of<BadDataError>([&] { Document::parse_json(deep, "x.json"); }),
              HasSubstr("nested too deeply"));
  EXPECT_THAT(yaml_error(deep), HasSubstr("r.yaml"));
}

TEST(Document, ErrorsOfJsonNameLineAndColumn) {
  const std::string message = message_of<BadDataError>(
      [] { Document::parse_json("{\n  \"a\": 1,\n  \"b\": ?\n}", "x.json"); });
  EXPECT_THAT(message, HasSubstr("x.json: parse error at line 3, column 8"));
}

TEST(Document, LocationsFollowJsonPointersInBothLanguages) {
  const std::string text = "{\n \"a\": {\n  \"b\": [\n   1,\n   {\"c\": 2}\n  ]\n }\n}\n";
  const Document as_json = Document::parse_json(text, "x.json");
  EXPECT_EQ(as_json.location("/a/b"), "x.json:3");
  EXPECT_EQ(as_json.location("/a/b/1/c"), "x.json:5");
  EXPECT_EQ(as_json.location("/a/missing"), "x.json:2") << "as far as there is something";
  const Document as_yaml = Document::parse_yaml("# why\na:\n  b: 1\n  c: {d: 2}\n", "r.yaml");
  EXPECT_EQ(as_yaml.location("/a/b"), "r.yaml:3");
  EXPECT_EQ(as_yaml.location("/a/c/d"), "r.yaml:4");
}

TEST(Document, WhatWasSetLaterKeepsItsOwnOrigin) {
  Document document = Document::parse_yaml("a: {b: 1}\n", "r.yaml");
  document.set("/a/b", 2, "--set a.b=2");
  EXPECT_EQ(document.json()["a"]["b"], 2);
  EXPECT_EQ(document.location("/a/b"), "--set a.b=2");
  EXPECT_EQ(document.location("/a"), "r.yaml:1");
  document.remove("/a/b");
  EXPECT_TRUE(document.json()["a"].empty());
}

std::string schema_message(const std::string& yaml, const char* schema) {
  const auto error = schema_error(Document::parse_yaml(yaml, "r.yaml"), json::parse(schema));
  return error.value_or("valid");
}

constexpr const char* kSchema = R"({"type": "object", "required": ["name"],
  "additionalProperties": false, "properties": {
    "name": {"type": "string"},
    "faces": {"type": "integer", "minimum": 4, "maximum": 100},
    "kind": {"type": "string", "enum": ["a", "b"]},
    "axis": {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}}})";

TEST(SchemaCheck, AValidDocumentHasNoError) {
  EXPECT_EQ(schema_message("name: x\nfaces: 4\naxis: [1, 2, 3]\n", kSchema), "valid");
}

TEST(SchemaCheck, ErrorsAreOneSentenceWithTheLine) {
  EXPECT_EQ(schema_message("name: x\nfaces: 3\n", kSchema),
            "r.yaml:2: faces is 3; it must be a whole number, at least 4, at most 100");
  EXPECT_EQ(schema_message("name: x\nfaces: many\n", kSchema),
            "r.yaml:2: faces is \"many\"; it must be a whole number, at least 4, at most 100");
  EXPECT_EQ(schema_message("name: x\nkind: c\n", kSchema),
            "r.yaml:2: kind is \"c\"; it must be one of [\"a\",\"b\"]");
  EXPECT_EQ(schema_message("name: x\n\nfacs: 4\n", kSchema),
            "r.yaml:3: unknown key 'facs'; did you mean 'faces'?");
  EXPECT_EQ(schema_message("faces: 4\n", kSchema), "r.yaml:1: the document lacks the key 'name'");
  EXPECT_THAT(schema_message("name: x\naxis:\n- 1\n- x\n- 3\n", kSchema),
              HasSubstr("r.yaml:4: axis.1 is \"x\"; it must be a number"));
}

}  // namespace
}  // namespace organbake
