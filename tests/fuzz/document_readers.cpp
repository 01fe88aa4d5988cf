// SPDX-License-Identifier: GPL-3.0-or-later
// Documents in text: scripts, recipes, light, tissue, data sets, tables.
#include "fuzz/readers.h"
#include "organbake/bundle/lighting.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/core/files.h"
#include "organbake/dataset/dataset.h"
#include "organbake/pipelines/batch_cases.h"
#include "organbake/pipelines/document.h"
#include "organbake/pipelines/documents.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/player/script.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/volume/labels.h"
#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

const std::vector<std::string> kScriptFiles = {"script.json", "cameras.json"};

void read_any_script(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_script(folder.parts(kScriptFiles, bytes) / "script.json");
}

void read_any_recipe(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_recipe(folder.file("recipe.yaml", bytes), {});
}

void read_lighting(std::span<const std::byte> bytes, const InputFolder&) {
  lighting_from_json(text_of(bytes), "lighting.json");
}

constexpr std::size_t kVertices = 4;

void read_mechanics(std::span<const std::byte> bytes, const InputFolder&) {
  mechanics_from_json(text_of(bytes), "mechanics.json", kVertices);
}

void read_dataset(std::span<const std::byte> bytes, const InputFolder&) {
  dataset_spec_from_json(text_of(bytes), "dataset.json");
}

// As `organplay --lens` does, but for its size.
void read_scope(std::span<const std::byte> bytes, const InputFolder&) {
  constexpr int kSide_px = 12;
  LensPicture(scope_lens_from_json(text_of(bytes), "lens.json").in_size(kSide_px, kSide_px),
              "lens.json");
}

void read_manifest(std::span<const std::byte> bytes, const InputFolder&) {
  manifest_from_json(text_of(bytes), "manifest.json");
}

void read_table(std::span<const std::byte> bytes, const InputFolder& folder) {
  case_table_text(read_case_table(folder.file("cases.csv", bytes)));
}

void read_labels(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_label_names(folder.file("labels.txt", bytes));
}

// As `organbake validate` does: any document that names one of our schemas.
void check_any_document(std::span<const std::byte> bytes, const InputFolder&) {
  const Document document = Document::parse_json(text_of(bytes), "document.json");
  check_document(document, schema_of(document));
}

const char* const kScript = R"({"schema": "organbake/interaction/1", "name": "two tools",
 "time_step_s": 0.02, "frames": 9, "size": [32, 24],
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0},
                          {"frame": 8, "azimuth_rad": 1, "elevation_rad": 0.5, "distance": 2}]},
 "instruments": [{"name": "p", "mode": "grab", "radius_mm": 4,
                  "path": [{"time_s": 0, "position_mm": [1, 2, 3]},
                           {"time_s": 1, "direction": [0, 1, 0], "depth_mm": 5}]}]})";
const char* const kFreeScript = R"({"schema": "organbake/interaction/1", "name": "free",
 "time_step_s": 0.02, "frames": 5, "size": [32, 24],
 "camera": {"intrinsics": {"fx": 30, "fy": 30, "cx": 16, "cy": 12},
   "keyframes": [{"frame": 0, "camera_from_world": {"rotation": [[1,0,0],[0,1,0],[0,0,1]],
                                                    "translation_mm": [1, 2, 300]}},
                 {"frame": 4, "position_mm": [0, 0, -300], "look_at_mm": [0, 0, 0],
                  "up_direction": [0, 1, 0]}]},
 "instruments": []})";
const char* const kRecordedScript = R"({"schema": "organbake/interaction/1", "name": "recorded",
 "time_step_s": 0.02, "frames": 2, "size": [8, 6], "camera": {"recorded": "cameras.json"},
 "instruments": []})";

const char* const kToolScript = R"({"schema": "organbake/interaction/1", "name": "tools",
 "time_step_s": 0.01, "frames": 5, "size": [32, 24], "solver": "fem", "light": "scope",
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0, "roll_rad": 0.2,
                           "right": 0.1, "up": -0.1}]},
 "instruments": [
  {"name": "c", "mode": "cut", "axis_mm": [0, 0, 20], "cut_width_mm": 1,
   "path": [{"time_s": 0, "position_mm": [1, 2, 3]}]},
  {"name": "s", "mode": "snip", "axis_mm": [0, 0, 20], "opens_along": [1, 0, 0],
   "path": [{"time_s": 0, "position_mm": [1, 2, 3], "opening_mm": 8},
            {"time_s": 0.1, "direction": [0, 0, 1], "depth_mm": 1, "opening_mm": 0}]},
  {"name": "n", "mode": "pierce", "radius_mm": 0.5, "axis_mm": [0, 0, 60], "trocar_mm": [9, 8, 7],
   "path": [{"time_s": 0, "position_mm": [1, 2, 3]}]},
  {"name": "p", "mode": "poke", "shaft": [1, 2, 0],
   "path": [{"time_s": 0, "direction": [0, 1, 0], "depth_mm": 2}]}]})";

Seeds script_seeds() {
  return {joined_parts({{0, kScript}}), joined_parts({{0, kFreeScript}}),
          joined_parts({{0, kToolScript}}),
          joined_parts({{0, kRecordedScript}, {1, cameras_to_json(small_bundle().cameras)}})};
}

Seeds recipe_seeds() {
  return {
      "schema: organbake/recipe/1\nname: organ\nphantom: {size_voxels: [32, 32, 16], seed: 3}\n"
      "isosurface: {smooth_mm: 1.5, largest: 1}\ndecimate: {faces: auto}\n"
      "mechanics: {young_modulus_kpa: 10, anchor_fraction: 0.5}\nplace: {count: 12}\n"
      "capture: {material: liver}\nbundle: {surface: true}\n",
      "schema: organbake/recipe/1\nname: \"a\\tb\"\nquality: draft\ndecimate:\n  faces: 16\n"};
}

Seeds lighting_seeds() {
  Lighting plain;
  plain.ambient_above = {0.5, 0.5, 0.5};
  plain.lamps = {{Eigen::Vector3d::UnitX(), {1, 0.9, 0.8}}};
  Lighting scope = plain;
  scope.gloss = wet_gloss();
  scope.scope = ScopeLight{};
  scope.finish.relief_slope = 0.1;
  return {lighting_to_json(plain), lighting_to_json(scope)};
}

Seeds mechanics_seeds() {
  MechanicsModel model = small_bundle().mechanics;
  model.elimination_order = {2, 1, 3};
  MechanicsModel solid = small_bundle().mechanics;
  solid.body = small_body();
  return {mechanics_to_json(model), mechanics_to_json(solid)};
}

Seeds scope_seeds() {
  return {R"({"schema": "organbake/scope-lens/1", "width": 64, "height": 48, "fx": 60, "fy": 61,
        "cx": 32, "cy": 24, "distortion_k1_k2_p1_p2_k3": [-0.3, 0.1, 0.001, -0.002, 0.01],
        "vignette_exponent": 3})"};
}

Seeds dataset_seeds() {
  return {R"({"schema": "organbake/dataset/1", "frames": 7, "name": "n", "seed": 9,
        "clip_frames": 4, "shard_frames": 8, "size": [32, 24],
        "layers": ["depth", "mask"], "stereo_mm": 5, "test_share": 0.5, "time_step_s": 0.02,
        "views": {"cone_rad": 0.3, "distance": 1, "roll_rad": 0.1, "motion_deg": 2},
        "pokes": {"count": [1, 2], "depth_mm": [1, 3], "radius_mm": 4, "cone_rad": 0.1},
        "lights": ["world", "scope"], "gain": [0.5, 2], "noise": 3})"};
}

Seeds manifest_seeds() {
  Manifest manifest;
  manifest.name = "small";
  manifest.generator = "tests";
  manifest.input_hashes = {{"ct", std::string(64, 'a')}};
  manifest.seeds = {{"phantom", 7}};
  manifest.files = {{"cam_000/depth.exr", 12, std::string(64, '0')}};
  manifest.edited = {"cam_000/depth.exr"};
  return {manifest_to_json(manifest)};
}

Seeds table_seeds() {
  return {"case,ct,decimate.faces\na,scan.nii.gz,100\n\"b\",\"c,\"\"d\"\".nii\",\n",
          "case,label\nliver,5\n"};
}

Seeds label_seeds() {
  return {
      "################\n# ITK-SNAP\n    0     0    0    0        0  0  0    \"Clear Label\"\n"
      "    5   255    0    0        1  1  1    \"liver\"\n",
      "# 3D Slicer\n0 background 0 0 0 0\n5 liver 221 130 101 255\n", "5 liver\n7 spleen\n",
      R"({"labels": {"background": 0, "liver": 1, "kidneys": [2, 3]}})"};
}

Seeds document_seeds() {
  return {kScript,
          kToolScript,
          mechanics_seeds().front(),
          mechanics_seeds().back(),
          lighting_seeds().back(),
          manifest_seeds().front(),
          dataset_seeds().front(),
          scope_seeds().front(),
          cameras_to_json(small_bundle().cameras)};
}

const Words kJson = {"\"schema\": ",
                     "\"frames\": ",
                     "\"size\": ",
                     "\"camera\": ",
                     "\"keyframes\": ",
                     "\"recorded\": ",
                     "\"instruments\": ",
                     "\"path\": ",
                     "\"solver\": ",
                     "\"light\": ",
                     "\"time_s\": ",
                     "\"direction\": ",
                     "\"anchors\": ",
                     "\"springs\": ",
                     "\"mass_kg\": ",
                     "\"nodes_mm\": ",
                     "\"tetrahedra\": ",
                     "\"lamps\": ",
                     "\"gloss\": ",
                     "\"scope\": ",
                     "\"bytes\": ",
                     "\"sha256\": ",
                     "null",
                     "[]",
                     "{}",
                     "[[[[[[[[",
                     "1e308",
                     "-1",
                     "4294967296",
                     "0.5",
                     "true",
                     "\"\\ud800\"",
                     "\"..\"",
                     kPartMark};

}  // namespace

std::vector<FuzzReader> document_readers() {
  return {
      {"script", read_any_script, script_seeds, kJson, 2400},
      {"recipe",
       read_any_recipe,
       recipe_seeds,
       {"phantom:", "isosurface:", "decimate:", "mechanics:",  "place:", "capture:",
        "bundle:",  "quality: ",   "inputs:",   "faces: ",     "auto",   "&a ",
        "*a",       "<<: ",        "? ",        "!!binary ",   "- ",     "[[",
        "{",        "}",           "|\n",       ">\n",         "\"",     ".nan",
        "1e999",    "~",           "---\n",     "%YAML 1.2\n", "# "},
       480},
      {"lighting", read_lighting, lighting_seeds, kJson, 3200},
      {"mechanics", read_mechanics, mechanics_seeds, kJson, 3200},
      {"dataset", read_dataset, dataset_seeds, kJson, 3200},
      {"scope-lens",
       read_scope,
       scope_seeds,
       {"\"fx\": ", "\"distortion_k1_k2_p1_p2_k3\": ", "\"cameras\": ", "1e308", "-1", "null"},
       3200},
      {"manifest", read_manifest, manifest_seeds, kJson, 3200},
      {"case-table",
       read_table,
       table_seeds,
       {"case", ",", ";", "\"", "\"\"", "\r\n", "..", "/"},
       1200},
      {"label-names", read_labels, label_seeds, {"\"", "# ", "-1 ", "99999 ", "1e9 "}, 3200},
      {"document", check_any_document, document_seeds, kJson, 800},
  };
}

}  // namespace organbake
