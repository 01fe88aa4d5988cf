// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/documents.h"

#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/image/png.h"
#include "support/error_message.h"
#include "support/places.h"
#include "support/testing.h"

namespace organbake {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string yaml_error(const std::string& text) {
  return message_of(ExitCode::bad_recipe, [&] { Document::parse_yaml(text, "r.yaml"); });
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
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { Document::parse_json(deep, "x.json"); }),
              HasSubstr("nested too deeply"));
  EXPECT_THAT(yaml_error(deep), HasSubstr("r.yaml"));
}

TEST(Document, ErrorsOfJsonNameLineAndColumn) {
  const std::string message = message_of(
      ExitCode::bad_data, [] { Document::parse_json("{\n  \"a\": 1,\n  \"b\": ?\n}", "x.json"); });
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

Document parse(const std::string& text) { return Document::parse_json(text, "x.json"); }

std::string error_of(const std::string& text, const std::string& schema) {
  try {
    check_document(parse(text), schema);
  } catch (const BadDataError& error) {
    return error.what();
  }
  return "valid";
}

TEST(Schemas, AreTheFilesOfTheRepository) {
  const std::filesystem::path folder = in_clone("data-schemas");
  std::vector<std::string> files;
  for (const auto& file : list_files(folder)) {
    if (file.extension() != ".json") continue;  // the format's description in words
    const std::string name = file.stem().stem().string();
    files.push_back(name);
    EXPECT_EQ(schema_text(name), read_text_file(folder / file)) << name;
  }
  EXPECT_EQ(files, schema_names());
  EXPECT_THROW(schema_text("recepi"), UsageError);
}

TEST(Schemas, DocumentsSayWhichIsTheirs) {
  EXPECT_EQ(schema_of(parse(R"({"schema": "organbake/play-report/1"})")), "play-report");
  EXPECT_THROW(schema_of(parse(R"({"schema": "organbake/playreport/1"})")), BadDataError);
  EXPECT_THROW(schema_of(parse(R"([1, 2])")), BadDataError);
  EXPECT_THROW(schema_of(parse(R"({"schema": 3})")), BadDataError);
}

TEST(Schemas, WhatTheLibraryWritesIsValid) {
  CameraSet set;
  set.cameras.resize(2);
  for (PosedCamera& camera : set.cameras) {
    camera.intrinsics = {.width = 4, .height = 4, .fx = 1, .fy = 1, .cx = 2, .cy = 2, .k1 = 0.1};
  }
  set.images = {"a.png", "b.png"};
  set.manifold.directions = {{1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(error_of(cameras_to_json(set), "cameras"), "valid");
  MechanicsModel model;
  model.mass_kg = {0.1, 0.2};
  model.springs = {{0, 1, 2.0, 3.0, 0.0}};
  model.young_modulus_kpa = model.density_kg_per_m3 = model.thickness_mm = 1;
  model.instrument_radius_mm = 5;
  EXPECT_EQ(error_of(mechanics_to_json(model), "mechanics"), "valid");
}

constexpr const char* kScript = R"({
  "schema": "organbake/interaction/1", "name": "poke", "time_step_s": 0.016, "frames": 10,
  "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0.1}]},
  "instruments": [{"name": "tip", "radius_mm": 5, "mode": "poke",
    "path": [{"time_s": 0, "direction": [0, -1, 0], "depth_mm": -10},
             {"time_s": 1, "position_mm": [1, 2, 3]}]}]
})";

TEST(Schemas, InteractionScriptsAreCheckedKeyByKey) {
  EXPECT_EQ(error_of(kScript, "interaction"), "valid");
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = kScript;
    return error_of(text.replace(text.find(from), from.size(), to), "interaction");
  };
  EXPECT_THAT(with("0.016", "0.5"), HasSubstr("x.json:2: time_step_s is 0.5"));
  EXPECT_THAT(with("0.016", "0"), HasSubstr("at least"));
  EXPECT_THAT(with("\"frames\": 10", "\"frames\": 0"), HasSubstr("frames is 0"));
  EXPECT_THAT(with("\"poke\",\n", "\"stab\",\n"), HasSubstr("instruments.0.mode is \"stab\""));
  EXPECT_THAT(with("\"position_mm\"", "\"position\""), HasSubstr("unknown key"));
  EXPECT_NE(with(", \"depth_mm\": -10", ""), "valid") << "a direction needs a depth";
  EXPECT_NE(with("\"position_mm\"", "\"depth_mm\": 1, \"position_mm\""), "valid")
      << "a place does not";
  EXPECT_THAT(with("\"elevation_rad\": 0.1", "\"elevation_rad\": 45"),
              HasSubstr("elevation_rad is 45"));
}

using testing::StartsWith;

TEST(HtmlPage, EscapesWhatIsText) {
  EXPECT_THAT(html_page("a<b", "", ""), HasSubstr("<title>a&lt;b</title>"));
  EXPECT_EQ(html_cell("<script>"), "<td>&lt;script&gt;</td>");
  EXPECT_THAT(html_picture(Rgb8Image(1, 1), "a \"b\""), HasSubstr("alt=\"a &quot;b&quot;\""));
}

// RFC 4648 digits of a PNG, read back by hand; widths give file sizes of every remainder by 3.
std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned buffer = 0;
  int bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    buffer = buffer << 6 | static_cast<unsigned>(digits.find(c));
    if ((bits += 6) >= 8) bytes += static_cast<char>(buffer >> (bits -= 8) & 255);
  }
  return bytes;
}

TEST(HtmlPage, PicturesAreWholeInTheirLink) {
  std::set<std::size_t> remainders;
  for (int width = 1; width < 40; ++width) {
    Rgb8Image image(width, 3);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = (i * 37 + 11) % 256;
    const std::string uri = png_data_uri(image), start = "data:image/png;base64,";
    ASSERT_THAT(uri, StartsWith(start));
    EXPECT_EQ((uri.size() - start.size()) % 4, 0u);
    EXPECT_EQ(from_base64(uri.substr(start.size())), encode_png(image));
    remainders.insert(encode_png(image).size() % 3);
  }
  EXPECT_EQ(remainders.size(), 3u) << "a remainder was not tried";
}

TEST(PageNumber, HasFourDigitsThatCount) {
  EXPECT_EQ(page_number(0), "0");
  EXPECT_EQ(page_number(0.012345678), "0.01235");
  EXPECT_EQ(page_number(-2.5), "-2.5");
  EXPECT_EQ(page_number(1234.56), "1235");
  EXPECT_EQ(page_number(12e6), "12000000");
  EXPECT_EQ(page_number(std::numeric_limits<double>::infinity()), "inf");
}

}  // namespace
}  // namespace organbake
