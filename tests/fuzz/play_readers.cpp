// SPDX-License-Identifier: GPL-3.0-or-later
// What the readers of bundles and scripts let pass must be playable: steps and draws end, tissue
// stays finite, no depth lies behind the eye.
#include <cmath>
#include <stdexcept>

#include "fuzz/readers.h"
#include "player/play.h"
#include "player/player.h"
#include "unit/bundle/small_bundle.h"

namespace organbake {
namespace {

constexpr int kWidth = 24, kHeight = 18;

// Not the project's own error: a finding.
void expect(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(what);
}

void expect_sound(const Player& player, const Frame& frame) {
  for (const Eigen::Vector3d& place : player.proxy_positions())
    expect(place.allFinite(), "a vertex of the tissue is no place");
  for (const float depth : frame.depth_mm) expect(depth >= 0, "a depth is behind the eye");
  expect(frame.color.pixels.size() == std::size_t(3) * frame.color.width * frame.color.height,
         "a picture of another size than it says");
}

// Poked from outside in, along the way from an eye.
void poke_and_draw(Player& player, const OrbitPose& pose) {
  const View view = orbit_view(player.bundle().cameras, pose, kWidth, kHeight);
  const std::vector<Eigen::Vector3d> rest = player.proxy_positions();
  DrawOptions options;
  options.keep_depth = true;
  Frame frame;
  for (int step = 0; step < 4; ++step) {
    InstrumentTip tip;
    tip.active = true;
    tip.radius_mm = 1;
    const Eigen::Vector3d eye = view.camera.camera_from_world.inverse().translation;
    tip.position_mm = eye + 0.25 * (step + 1) * (rest.front() - eye);
    player.step({tip});
    player.draw(view, options, frame);
    expect_sound(player, frame);
  }
}

void play_bundle(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path bundle = folder.parts(kBundleFiles, bytes);
  Manifest manifest;
  manifest.name = "sealed";
  write_manifest(bundle, manifest);
  Player player(bundle);
  poke_and_draw(player, {});
  OrbitPose behind;
  behind.azimuth_rad = 2;
  behind.distance = 0.7;
  poke_and_draw(player, behind);
}

// A few frames of any script, small, whatever it asks for.
void play_script(std::span<const std::byte> bytes, const InputFolder&) {
  Script script = script_from_json(text_of(bytes), "script.json");
  constexpr int kMostFrames = 4;
  script.frames = std::min(script.frames, kMostFrames);
  if (script.width > kWidth || script.height > kHeight) return;
  Player player(small_bundle());
  PlayOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.draw.keep_depth = true;
  play(player, script, options, [&](int, const Frame& frame) { expect_sound(player, frame); });
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
                           {"time_s": 0.05, "direction": [0, 0, 1], "depth_mm": 1}]}]})"};
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
