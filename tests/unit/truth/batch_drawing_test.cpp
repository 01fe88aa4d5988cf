// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/batch_drawing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/player/orbit.h"
#include "organbake/truth/truth_tracker.h"
#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

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
                     flow = std::vector<float>(2 * kPixels * kStates);

  BatchPlanes planes() {
    return {rgb.data(), depth_mm.data(), mask.data(), flow.data(), seen.data()};
  }
  bool operator==(const Pictures&) const = default;
};

Pictures one_after_the_other(const std::vector<View>& views) {
  Player player(organ());
  LayerSet layers;
  layers.depth = layers.mask = layers.flow = true;
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
    try {
      batch.draw(states, given, DrawnLight::baked, room.planes());
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
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
