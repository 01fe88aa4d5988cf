// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/truth/flow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "organbake/image/srgb.h"
#include "organbake/player/orbit.h"
#include "traced_organ.h"

namespace organbake {
namespace {

constexpr int kFlowSide_px = 320;

// What the issue of the truth layers asks of flow.
constexpr double kMean_px = 0.1, kHiddenIou = 0.95, kWarped_db = 35;

class FlowTest : public testing::Test {
 protected:
  // One moment, a poke and a turn later another, and the traced truth of both.
  void play(double turn_rad, double poke_mm) {
    const View views[] = {view(0), view(turn_rad)};
    for (int i = 0; i < 2; ++i) {
      if (i == 1 && poke_mm > 0) poke(player_, poke_mm);
      pictures_[i] = draw_with_truth(player_, views[i], {}, tracker_);
      carried_[i] = traced_surface().carry(player_.proxy_positions());
      traced_[i] = traced(carried_[i], views[i]);
      views_[i] = views[i];
    }
    tracker_.find_forward(forward_);
    tracker_.find_backward(backward_);
  }
  View view(double azimuth) const {
    return orbit_view(traced_organ().cameras, {azimuth, 0.1}, kFlowSide_px, kFlowSide_px);
  }
  Eigen::Vector2d center(std::size_t i) const {
    return {double(i % kFlowSide_px) + 0.5, double(i / kFlowSide_px) + 0.5};
  }
  // Where the traced point of a pixel lies in the other picture.
  Eigen::Vector2d traced_px(int from, std::size_t i) const {
    const int to = 1 - from;
    return project(views_[to].camera, traced_surface().point(traced_[from].seen[i], carried_[to]));
  }

  Player player_{traced_organ()};
  TruthTracker tracker_{layers_from("flow")};
  Rgb8Image pictures_[2];
  std::vector<Eigen::Vector3d> carried_[2];
  Traced traced_[2];
  View views_[2];
  Flow forward_, backward_;
};

TEST_F(FlowTest, IsTheMotionOfTheSameSkinPoints) {
  play(0.05, 8);
  for (const int from : {0, 1}) {
    const Flow& flow = from == 0 ? forward_ : backward_;
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < flow.px.size(); ++i) {
      if (!traced_[from].covered(i) || traced_[from].outline[i]) continue;
      sum += (flow.px[i].cast<double>() - (traced_px(from, i) - center(i))).norm();
      ++count;
    }
    ASSERT_GT(count, 20000u);
    RecordProperty(from == 0 ? "forward_px" : "backward_px", std::to_string(sum / double(count)));
    EXPECT_LE(sum / double(count), kMean_px) << from;
  }
}

TEST_F(FlowTest, KnowsWhatIsHidden) {
  play(0.5, 12);
  for (const int from : {0, 1}) {
    const Flow& flow = from == 0 ? forward_ : backward_;
    const Sight sight(carried_[1 - from], views_[1 - from]);
    std::vector<bool> hidden(flow.px.size()), traced_hidden(flow.px.size());
    for (std::size_t i = 0; i < flow.px.size(); ++i) {
      if (!traced_[from].covered(i)) continue;
      hidden[i] = flow.seen[i] == 0;
      traced_hidden[i] =
          !sight.sees(traced_surface().point(traced_[from].seen[i], carried_[1 - from]));
    }
    const double iou = intersection_over_union(hidden, traced_hidden);
    RecordProperty(from == 0 ? "hidden_forward" : "hidden_backward", std::to_string(iou));
    EXPECT_GE(iou, kHiddenIou) << from;
  }
}

TEST_F(FlowTest, WarpsOnePictureIntoTheNext) {
  play(0.03, 6);
  const auto& linear = linear_from_srgb8();
  double sum2 = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < forward_.px.size(); ++i) {
    if (!forward_.seen[i] || traced_[0].outline[i]) continue;
    const Eigen::Vector2d at =
        center(i) + forward_.px[i].cast<double>() - Eigen::Vector2d(0.5, 0.5);
    const int x = int(std::floor(at.x())), y = int(std::floor(at.y()));
    if (x < 0 || y < 0 || x + 1 >= kFlowSide_px || y + 1 >= kFlowSide_px) continue;
    if (traced_[1].outline[std::size_t(y) * kFlowSide_px + x]) continue;
    const double u = at.x() - x, v = at.y() - y;
    for (int c = 0; c < 3; ++c) {
      const auto light = [&](int dx, int dy) { return linear[pictures_[1].at(x + dx, y + dy)[c]]; };
      const double there = (1 - u) * (1 - v) * light(0, 0) + u * (1 - v) * light(1, 0) +
                           (1 - u) * v * light(0, 1) + u * v * light(1, 1);
      const double off = double(srgb8_from_linear(float(there))) - pictures_[0].pixels[3 * i + c];
      sum2 += off * off;
    }
    count += 3;
  }
  const double psnr_db = 10 * std::log10(255 * 255 * double(count) / sum2);
  RecordProperty("warped_db", std::to_string(psnr_db));
  EXPECT_GE(psnr_db, kWarped_db);
}

TEST_F(FlowTest, StandsStillWhereNothingMoves) {
  play(0, 0);
  for (std::size_t i = 0; i < forward_.px.size(); ++i) {
    EXPECT_LT(forward_.px[i].norm(), 1e-3f);
    const bool skin = tracker_.now().label[i] != 0;
    if (traced_[0].outline[i]) continue;
    EXPECT_EQ(forward_.seen[i] != 0, skin) << i;
  }
}

// A ball that moves across the view: its own pixels follow it, what it comes to hide is hidden.
TEST_F(FlowTest, FollowsTools) {
  const View from = view(0);
  const Eigen::Vector3d eye = from.camera.center_world_mm(),
                        middle = traced_organ().cameras.manifold.center_world_mm,
                        right = from.camera.camera_from_world.rotation.row(0);
  Solid ball;
  ball.from = ball.to = middle + 0.5 * (eye - middle);
  ball.radius_mm = 8;
  Solid moved = ball;
  const double shift_mm = 20;
  moved.from = moved.to = ball.from + shift_mm * right;
  draw_with_truth(player_, from, {ball}, tracker_);
  draw_with_truth(player_, from, {moved}, tracker_);
  tracker_.find_forward(forward_);
  const PixelTruth &before = tracker_.before(), &now = tracker_.now();
  const Traced skin = traced(traced_surface().at_rest().vertices, from);
  std::size_t tool = 0, hidden = 0;
  for (std::size_t i = 0; i < before.pixels(); ++i) {
    if (before.label[i] >= kFirstToolLabel) {
      const double px = from.camera.intrinsics.fx * shift_mm / before.depth_mm[i];
      EXPECT_NEAR(forward_.px[i].x(), px, 1e-2);
      EXPECT_NEAR(forward_.px[i].y(), 0, 1e-2);
      ++tool;
    } else if (before.label[i] != 0) {
      const bool covered = now.label[i] >= kFirstToolLabel;
      if (skin.outline[i]) continue;
      EXPECT_EQ(forward_.seen[i] == 0, covered) << i;
      hidden += covered;
    }
  }
  EXPECT_GT(tool, 200u);
  EXPECT_GT(hidden, 100u);
  draw_with_truth(player_, from, {}, tracker_);  // taken away
  tracker_.find_forward(forward_);
  for (std::size_t i = 0; i < forward_.px.size(); ++i)
    EXPECT_FALSE(tracker_.before().label[i] >= kFirstToolLabel && forward_.seen[i]) << i;
}

}  // namespace
}  // namespace organbake
