// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/schemas.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

using testing::HasSubstr;

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
  const std::filesystem::path folder = std::filesystem::path(ORGANBAKE_SOURCE_DIR) / "data-schemas";
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

}  // namespace
}  // namespace organbake
