// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/truth/truth_recorder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/image/exr_reader.h"
#include "organbake/image/png.h"
#include "organbake/player/orbit.h"
#include "organbake/player/script_camera.h"
#include "traced_organ.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

constexpr int kSide_px = 120, kFrames = 3;
constexpr double kBaseline_mm = 5;

class TruthRecorderTest : public testing::Test {
 protected:
  static Script script() {
    Script script;
    script.name = "truth";
    script.frames = kFrames;
    script.width = script.height = kSide_px;
    script.camera = {{0, {}}, {2, {0.2, 0.1}}};
    const Eigen::Vector3d front = traced_organ().cameras.manifold.directions.front();
    script.instruments = {
        {"probe", {.radius_mm = 6}, {{0, std::nullopt, front, -2}, {1, std::nullopt, front, 30}}}};
    return script;
  }
  std::vector<Rgb8Image> record(const Script& script, const TruthOptions& options) {
    PlayOptions play_options;
    play_options.draw.keep_bound = true;
    TruthRecorder recorder(folder_.path(), options, play_options.draw);
    std::vector<Rgb8Image> frames;
    play_options.watch = [&](const PlayedScene& scene) {
      frames.push_back(scene.picture.color);
      recorder.add(player_, scene);
    };
    play(player_, script, play_options, {});
    recorder.finish();
    return frames;
  }
  ChannelImage layer(const std::string& name) const { return read_exr(folder_.path() / name); }

  TemporaryFolder folder_;
  Player player_{traced_organ()};
};

TruthOptions everything() {
  TruthOptions options;
  options.layers = layers_from("all");
  options.baseline_mm = kBaseline_mm;
  options.instruments = {"probe"};
  return options;
}

TEST_F(TruthRecorderTest, WritesEveryLayerOfBothEyes) {
  record(script(), everything());
  for (const char* eye : {"", "right/"}) {
    const std::string in = eye;
    for (int f = 0; f < kFrames; ++f) {
      const std::string number = "_000" + std::to_string(f);
      EXPECT_NE(layer(in + "depth" + number + ".exr").find("Z"), nullptr);
      EXPECT_EQ(layer(in + "normals" + number + ".exr").channels.size(), 3u);
      EXPECT_EQ(layer(in + "id" + number + ".exr").channels.size(), 5u);
      EXPECT_EQ(layer(in + "weight" + number + ".exr").channels.size(), 1u);
      const ChannelImage flow = layer(in + "flow" + number + ".exr");
      EXPECT_EQ(flow.find("forward.x") != nullptr, f + 1 < kFrames) << f;
      EXPECT_EQ(flow.find("backward.seen") != nullptr, f > 0) << f;
      EXPECT_EQ(read_png(folder_.path() / (in + "mask" + number + ".png")).width, kSide_px);
    }
    EXPECT_EQ(read_cameras(folder_.path() / (in + "cameras.json")).cameras.size(), 3u);
  }
  EXPECT_EQ(read_png(folder_.path() / "right/frame_0002.png").width, kSide_px);
}

// A rectified pair: a point of the left eye lies disparity = fx · baseline / depth further left, in
// the same row, at the same depth.
TEST_F(TruthRecorderTest, EyesAgreeByTheirDepth) {
  record(script(), everything());
  const std::vector<float> left = layer("depth_0001.exr").floats("Z", ""),
                           right = layer("right/depth_0001.exr").floats("Z", "");
  const double fx = read_cameras(folder_.path() / "cameras.json").cameras[1].intrinsics.fx;
  std::size_t agree = 0, count = 0;
  for (int y = 0; y < kSide_px; ++y) {
    for (int x = 0; x < kSide_px; ++x) {
      const float depth = left[std::size_t(y) * kSide_px + x];
      if (!std::isfinite(depth)) continue;
      const int there = int(std::floor(x + 0.5 - fx * kBaseline_mm / depth));
      if (there < 0) continue;
      ++count;
      constexpr double kPixelOfSlope_mm = 3;
      agree += std::abs(right[std::size_t(y) * kSide_px + there] - depth) < kPixelOfSlope_mm;
    }
  }
  ASSERT_GT(count, 2000u);
  EXPECT_GT(double(agree), 0.95 * double(count));  // the rest is hidden from one eye
}

TEST_F(TruthRecorderTest, TellsTheSceneBehindEachFrame) {
  record(script(), everything());
  std::ifstream lines(folder_.path() / "scenes.jsonl");
  std::string line;
  int number = 0;
  for (; std::getline(lines, line); ++number) {
    const auto scene = nlohmann::json::parse(line);
    EXPECT_EQ(scene["frame"], number);
    EXPECT_EQ(scene["camera"]["camera_from_world"].size(), 3u);
    EXPECT_EQ(scene["instruments"][0]["name"], "probe");
    EXPECT_EQ(scene["instruments"][0]["label"], 101);
    EXPECT_EQ(scene["proxy_mm"][0].size(), traced_organ().proxy.vertices.size());
  }
  EXPECT_EQ(number, kFrames);
}

// What was recorded plays back: the same pictures from the cameras that were written.
TEST_F(TruthRecorderTest, PlaysBackFromItsCameras) {
  const auto frames = record(script(), everything());
  Script again = script();
  again.camera.clear();
  take_recorded(read_cameras(folder_.path() / "cameras.json"), "cameras.json", again);
  const auto repeated = record(again, everything());
  ASSERT_EQ(frames.size(), repeated.size());
  for (std::size_t f = 0; f < frames.size(); ++f)
    EXPECT_EQ(frames[f].pixels, repeated[f].pixels) << f;
}

TEST_F(TruthRecorderTest, RefusesWhatCannotBe) {
  TruthOptions options = everything();
  options.baseline_mm = 0;
  EXPECT_THROW(options.check(1), UsageError);
  options.baseline_mm = std::nan("");
  EXPECT_THROW(options.check(1), UsageError);
  options = everything();
  EXPECT_NO_THROW(options.check(1));
  EXPECT_THROW(options.check(101), UsageError);
}

}  // namespace
}  // namespace organbake
