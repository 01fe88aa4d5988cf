// SPDX-License-Identifier: GPL-3.0-or-later
// Bundles, packs, scripts and states. What the readers let pass must be playable.
#include <cmath>

#include "fuzz/readers.h"
#include "organbake/bundle/bundle_pack.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/bundle/stored_maps.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/player/play.h"
#include "organbake/player/player.h"
#include "support/meshes.h"
#include "support/synthetic_bundle.h"

namespace organbake {

const std::vector<std::string> kBundleFiles = {
    "proxy.ply",         "cameras.json",      "mechanics.json",    "base.exr",
    "skin.exr",          "lighting.json",     "surface.ply",       "cam_000/depth.exr",
    "cam_000/color.exr", "cam_000/micro.exr", "cam_001/depth.exr", "cam_001/color.exr",
    "cam_001/micro.exr"};

namespace {

Manifest sealed() {
  Manifest manifest;
  manifest.name = "sealed";
  manifest.generator = "tests";
  return manifest;
}

void read_bundle(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path bundle = folder.parts(kBundleFiles, bytes);
  write_manifest(bundle, sealed());
  BundleReader(bundle).verify();
}

// One whose files were changed since: what `reseal` makes of it.
void reseal_bundle(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path bundle = folder.parts(kBundleFiles, bytes);
  write_manifest(bundle, sealed());
  reseal(bundle);
}

void read_pack_contents(std::span<const std::byte> bytes, const InputFolder&) {
  contents_of_pack(bytes, 1000);
}

void read_pack_frame(std::span<const std::byte> bytes, const InputFolder&) {
  unpacked_frame(bytes);
}

const Intrinsics kLens = small_bundle().cameras.cameras[0].intrinsics;
constexpr std::size_t kFaces = 4;

void read_pack_maps(std::span<const std::byte> bytes, const InputFolder&) {
  decoded_maps(bytes, kLens, kFaces, "maps");
}

Bundle with_skin() {
  Bundle bundle = small_bundle();
  bundle.skin = flat_skin(bundle.proxy, 2);
  bundle.base.face_count = 16;
  bundle.base.height_mm.resize(16 * 6), bundle.base.seen_by.resize(16 * 6);
  bundle.base.color.resize(16 * 6, {0, 0, 0});
  return bundle;
}

std::string parts_of(const Bundle& bundle) {
  const TemporaryFolder folder;
  write_bundle(folder.path(), bundle);
  std::vector<std::pair<std::size_t, std::string>> files;
  for (std::size_t i = 0; i < kBundleFiles.size(); ++i)
    if (std::filesystem::exists(folder.path() / kBundleFiles[i]))
      files.emplace_back(i, read_text_file(folder.path() / kBundleFiles[i]));
  return joined_parts(files);
}

std::string as_text(const std::vector<std::byte>& bytes) { return text_of(bytes); }

Seeds pack_contents_seeds() {
  const std::size_t contents = pack_contents_bytes(2);
  const auto rest = static_cast<std::uint32_t>(1000 - contents);
  return {as_text(pack_contents({{0, 100, 1000}, {0, rest - 100, 2000}}))};
}

Seeds pack_frame_seeds() {
  return {as_text(packed_frame(small_bundle())), as_text(packed_frame(with_skin()))};
}

Seeds pack_map_seeds() { return {as_text(coded_maps(small_bundle().maps[0], kLens))}; }

const Words kParts = {
    kPartMark,     "\"width\": ", "\"fx\": ", "\"springs\": ", "element face ", "dataWindow",
    "compression", "channels",    "Y",        "face",          "confidence"};

}  // namespace

Seeds bundle_seeds() { return {parts_of(small_bundle()), parts_of(with_skin())}; }

std::vector<FuzzReader> bundle_readers() {
  return {
      {"bundle", read_bundle, bundle_seeds, kParts, 600},
      {"reseal", reseal_bundle, bundle_seeds, kParts, 240},
      {"pack-contents", read_pack_contents, pack_contents_seeds, {}, 6000},
      {"pack-frame", read_pack_frame, pack_frame_seeds, {"\"width\": ", "\"springs\": "}, 3200},
      {"pack-maps", read_pack_maps, pack_map_seeds, {}, 6000},
  };
}

// What the readers of bundles and scripts let pass must be playable: steps and draws end, tissue
// stays finite, no depth lies behind the eye, and two threads draw what one does.

namespace {

constexpr int kWidth = 24, kHeight = 18;

// All that was drawn in one go, to be held against another.
using Pictures = std::vector<std::uint8_t>;

void add_sound(const Player& player, const Frame& frame, Pictures& pictures) {
  for (const Eigen::Vector3d& place : player.proxy_positions())
    expect_invariant(place.allFinite(), "a vertex of the tissue is no place");
  for (const float depth : frame.depth_mm)
    expect_invariant(depth >= 0, "a depth is behind the eye");
  expect_invariant(
      frame.color.pixels.size() == std::size_t(3) * frame.color.width * frame.color.height,
      "a picture of another size than it says");
  pictures.insert(pictures.end(), frame.color.pixels.begin(), frame.color.pixels.end());
}

template <class Work>
void expect_same_pictures(const Work& pictures_of) {
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return pictures_of();
  };
  const Pictures alone = with(1);
  expect_invariant(alone == with(2), "two threads draw other pictures than one");
}

// Poked from outside in, along the way from an eye.
void poke_and_draw(Player& player, const OrbitPose& pose, Pictures& pictures) {
  const View view = orbit_view(player.bundle().cameras, pose, kWidth, kHeight);
  const std::vector<Eigen::Vector3d> rest = player.proxy_positions();
  DrawOptions options;
  options.keep_depth = true;
  Frame frame;
  for (int step = 0; step < 4; ++step) {
    Instrument tip;
    tip.active = true;
    tip.radius_mm = 1;
    const Eigen::Vector3d eye = view.camera.camera_from_world.inverse().translation;
    tip.position_mm = eye + 0.25 * (step + 1) * (rest.front() - eye);
    player.step({tip});
    player.draw(view, options, frame);
    add_sound(player, frame, pictures);
  }
}

void play_bundle(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path bundle = folder.parts(kBundleFiles, bytes);
  Manifest manifest;
  manifest.name = "sealed";
  write_manifest(bundle, manifest);
  OrbitPose behind;
  behind.azimuth_rad = 2;
  behind.distance = 0.7;
  expect_same_pictures([&] {
    Pictures pictures;
    Player player(bundle);
    poke_and_draw(player, {}, pictures);
    poke_and_draw(player, behind, pictures);
    return pictures;
  });
}

// With tetrahedra where the script's solver needs them: what cuts does.
Bundle bundle_for(const Script& script) {
  Bundle bundle = small_bundle();
  if (script.solver == TissueSolver::fem) bundle.mechanics.body = small_body();
  return bundle;
}

// A few frames of any script, small, whatever it asks for.
void play_script(std::span<const std::byte> bytes, const InputFolder&) {
  Script script = script_from_json(text_of(bytes), "script.json");
  constexpr int kMostFrames = 4;
  script.frames = std::min(script.frames, kMostFrames);
  if (script.width > kWidth || script.height > kHeight) return;
  PlayOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.draw.keep_depth = true;
  expect_same_pictures([&] {
    Pictures pictures;
    Player player(bundle_for(script));
    if (script.solver) player.set_solver(*script.solver);
    play(player, script, options,
         [&](int, const Frame& frame) { add_sound(player, frame, pictures); });
    return pictures;
  });
}

Seeds played_script_seeds() {
  return {
      R"({"schema": "organbake/interaction/1", "name": "t", "time_step_s": 0.02, "frames": 4,
 "size": [24, 18], "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0},
                          {"frame": 3, "azimuth_rad": 1, "elevation_rad": 0.5, "distance": 2}]},
 "instruments": [{"name": "p", "mode": "grab", "radius_mm": 4,
                  "path": [{"time_s": 0, "position_mm": [1, 2, 3]},
                           {"time_s": 1, "direction": [0, 1, 0], "depth_mm": 5}]}]})",
      R"({"schema": "organbake/interaction/1", "name": "f", "time_step_s": 0.02, "frames": 4,
 "size": [24, 18], "camera": {"intrinsics": {"fx": 30, "fy": 30, "cx": 12, "cy": 9},
   "keyframes": [{"frame": 0, "position_mm": [0, 0, -30], "look_at_mm": [0, 0, 0],
                  "up_direction": [0, 1, 0]}]},
 "instruments": [{"name": "p", "mode": "poke", "shaft": [1, 0, 0],
                  "path": [{"time_s": 0, "direction": [0, 0, 1], "depth_mm": -1},
                           {"time_s": 0.05, "direction": [0, 0, 1], "depth_mm": 1}]}]})",
      R"({"schema": "organbake/interaction/1", "name": "c", "time_step_s": 0.02, "frames": 4,
 "size": [24, 18], "light": "world", "solver": "fem",
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0}]},
 "instruments": [{"name": "c", "mode": "cut", "axis_mm": [0, 0, 9], "cut_width_mm": 0.5,
                  "path": [{"time_s": 0, "position_mm": [-6, 0, 0]},
                           {"time_s": 0.08, "position_mm": [6, 0.5, 0]}]},
                 {"name": "n", "mode": "pierce", "axis_mm": [0, 0, 9], "radius_mm": 0.3,
                  "path": [{"time_s": 0, "position_mm": [0.5, 0.5, 6]},
                           {"time_s": 0.08, "position_mm": [0.5, 0.5, 0]}]}]})",
      R"({"schema": "organbake/interaction/1", "name": "s", "time_step_s": 0.02, "frames": 4,
 "size": [24, 18], "light": "scope", "solver": "fem",
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0}]},
 "instruments": [{"name": "s", "mode": "snip", "axis_mm": [0, 0, 5], "opens_along": [1, 0, 0],
                  "path": [{"time_s": 0, "position_mm": [0.3, 0.3, 0], "opening_mm": 4},
                           {"time_s": 0.08, "position_mm": [0.3, 0.3, 0], "opening_mm": 0}]}]})"};
}

const Words kWords = {kPartMark,
                      "\"time_step_s\": ",
                      "\"distance\": ",
                      "\"depth_mm\": ",
                      "\"radius_mm\": ",
                      "\"mode\": \"grab\"",
                      "\"axis_mm\": ",
                      "\"solver\": \"fem\"",
                      "\"light\": \"scope\"",
                      "\"stiffness",
                      "1e308",
                      "-1",
                      "1e-300",
                      "0",
                      "[0, 0, 0]"};

}  // namespace

std::vector<FuzzReader> play_readers() {
  return {
      {"bundle-play", play_bundle, bundle_seeds, kWords, 240},
      {"script-play", play_script, played_script_seeds, kWords, 600},
  };
}

}  // namespace organbake
