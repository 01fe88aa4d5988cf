// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/truth/truth_recorder.h"

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/temporary_files.h"
#include "organbake/image/exr.h"
#include "organbake/image/png.h"
#include "organbake/player/orbit.h"
#include "organbake/player/script.h"
#include "organbake/truth/batch_drawing.h"
#include "organbake/truth/pixel_truth.h"
#include "support/error_message.h"
#include "support/organs.h"
#include "support/testing.h"
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
  for (const double baseline_mm : {0.0, -5.0, 0.005, 1001.0, std::nan("")}) {
    options.baseline_mm = baseline_mm;
    EXPECT_THROW(options.check(1), UsageError) << baseline_mm;
  }
  options = everything();
  EXPECT_NO_THROW(options.check(1));
  EXPECT_THROW(options.check(101), UsageError);
}

constexpr int kWidth = 48, kHeight = 40;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight, kStates = 7;

const Bundle& organ() {
  static const Bundle bundle = [] {
    SyntheticOptions options;
    options.map_size = 48;
    return make_synthetic_bundle(options);
  }();
  return bundle;
}

// Each dented somewhere else, one after the other.
std::vector<double> states() {
  std::vector<double> xyz;
  for (std::size_t i = 0; i < kStates; ++i) {
    const Eigen::Vector3d to(std::cos(double(i)), std::sin(double(i)), 0.3);
    for (const Eigen::Vector3d& p : dented(organ().proxy, to, 4 + double(i)))
      xyz.insert(xyz.end(), p.data(), p.data() + 3);
  }
  return xyz;
}

std::vector<View> views() {
  std::vector<View> views;
  for (std::size_t i = 0; i < kStates; ++i)
    views.push_back(orbit_view(organ().cameras, {0.3 * double(i), 0.1}, kWidth, kHeight));
  return views;
}

struct Pictures {
  std::vector<std::uint8_t> rgb = std::vector<std::uint8_t>(3 * kPixels * kStates),
                            mask = std::vector<std::uint8_t>(kPixels * kStates), seen = mask;
  std::vector<float> depth_mm = std::vector<float>(kPixels * kStates),
                     normals = std::vector<float>(3 * kPixels * kStates),
                     flow = std::vector<float>(2 * kPixels * kStates);

  BatchPlanes planes() {
    return {rgb.data(), depth_mm.data(), normals.data(), mask.data(), flow.data(), seen.data()};
  }
  bool operator==(const Pictures&) const = default;
};

Pictures one_after_the_other(const std::vector<View>& views) {
  Player player(organ());
  LayerSet layers;
  layers.depth = layers.normals = layers.mask = layers.flow = true;
  TruthTracker truth(layers);
  Pictures all;
  Frame frame;
  DrawOptions options;
  options.keep_bound = true;
  const std::vector<double> xyz = states();
  const std::size_t numbers = xyz.size() / kStates;
  for (std::size_t i = 0; i < kStates; ++i) {
    player.set_vertices(std::span(xyz).subspan(i * numbers, numbers));
    player.draw(views[i], options, frame);
    std::copy(frame.color.pixels.begin(), frame.color.pixels.end(), &all.rgb[3 * kPixels * i]);
    truth.advance(player, views[i], {}, frame);
    const PixelTruth& now = truth.now();
    std::copy(now.depth_mm.begin(), now.depth_mm.end(), &all.depth_mm[kPixels * i]);
    std::copy(now.label.begin(), now.label.end(), &all.mask[kPixels * i]);
    std::copy_n(now.normal.data()->data(), 3 * kPixels, &all.normals[3 * kPixels * i]);
    if (!truth.has_before()) continue;
    Flow flow;
    truth.find_backward(flow);
    std::copy(flow.seen.begin(), flow.seen.end(), &all.seen[kPixels * i]);
    std::copy_n(flow.px.data()->data(), 2 * kPixels, &all.flow[2 * kPixels * i]);
  }
  return all;
}

TEST(BatchDrawing, IsWhatIsDrawnOneAfterTheOther) {
  const Pictures expected = one_after_the_other(views());
  EXPECT_GT(*std::max_element(expected.flow.begin(), expected.flow.end()), 0.5f);
  const std::vector<double> xyz = states();
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    const Player player(organ());
    BatchDrawing batch(player);
    for (int twice = 0; twice < 2; ++twice) {
      Pictures got;
      batch.draw({std::span(xyz), kStates}, views(), DrawnLight::baked, got.planes());
      EXPECT_TRUE(got == expected) << threads;
    }
  }
}

TEST(BatchDrawing, OneViewServesAll) {
  const std::vector<View> same(kStates, views()[2]);
  const std::vector<double> xyz = states();
  const std::vector<float> single(xyz.begin(), xyz.end());
  const Player player(organ());
  BatchDrawing batch(player);
  Pictures all, one;
  batch.draw({std::span(xyz), kStates}, same, DrawnLight::baked, all.planes());
  batch.draw({std::span(xyz), kStates}, std::span(same).first(1), DrawnLight::baked, one.planes());
  EXPECT_TRUE(all == one);
  BatchPlanes color;
  Pictures of_floats;
  color.rgb = of_floats.rgb.data();
  batch.draw({std::span(single), kStates}, std::span(same).first(1), DrawnLight::baked, color);
  std::size_t differ = 0;  // floats round places by a hundred-thousandth of a millimetre
  for (std::size_t i = 0; i < all.rgb.size(); ++i)
    differ += std::abs(int(all.rgb[i]) - int(of_floats.rgb[i])) > 8;
  EXPECT_LT(differ, all.rgb.size() / 100);
}

TEST(BatchDrawing, BadStatesAndViewsAreNamed) {
  std::vector<double> xyz = states();
  const Player player(organ());
  BatchDrawing batch(player);
  Pictures room;
  const auto said = [&](const StateBatch& states, std::span<const View> given) {
    return message_of(ExitCode::usage,
                      [&] { batch.draw(states, given, DrawnLight::baked, room.planes()); });
  };
  const std::vector<View> all = views();
  EXPECT_NE(said({std::span(xyz), kStates - 1}, all).find("numbers"), std::string::npos);
  EXPECT_NE(said({std::span(xyz), kStates}, std::span(all).first(2)).find("2 views for 7"),
            std::string::npos);
  EXPECT_NE(said({std::span(xyz), kStates, StateOf::nodes}, all).find("nodes"), std::string::npos);
  std::vector<View> sizes = all;
  sizes[3].camera.intrinsics.width = 50;
  EXPECT_NE(said({std::span(xyz), kStates}, sizes).find("one size"), std::string::npos);
  xyz[xyz.size() * 4 / 7 + 5] = std::nan("");
  EXPECT_EQ(said({std::span(xyz), kStates}, all).find("state 4: of the vertices, number 1"), 0u);
}

}  // namespace
}  // namespace organbake
