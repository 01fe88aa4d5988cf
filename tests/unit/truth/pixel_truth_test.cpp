// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/truth/pixel_truth.h"

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "organbake/player/orbit.h"
#include "support/error_message.h"
#include "support/testing.h"
#include "traced_organ.h"

namespace organbake {
namespace {

TEST(LayerSet, ReadsNamesAndAll) {
  EXPECT_FALSE(LayerSet().any());
  const LayerSet two = layers_from("mask,depth");
  EXPECT_TRUE(two.mask && two.depth);
  EXPECT_FALSE(two.flow || two.normals || two.id || two.weight);
  std::string every;
  for (const std::string& name : layer_names()) every += (every.empty() ? "" : ",") + name;
  EXPECT_EQ(layers_from(every), layers_from("all"));
}

TEST(LayerSet, SaysWhichThereAre) {
  for (const char* wrong : {"", "Depth", "depth,", "depth mask"}) {
    EXPECT_THAT(message_of(ExitCode::usage, [&] { layers_from(wrong); }),
                testing::HasSubstr("depth, flow, normals"));
  }
}

constexpr int kPixelSide_px = 320;

// What the issue of the truth layers asks of them.
constexpr double kDepthRms_mm = 0.05, kFarOff_mm = 1, kFarOffShare = 0.005;
constexpr double kMaskIou = 0.998, kNormals_deg = 2;

class PixelTruthTest : public testing::Test {
 protected:
  const PixelTruth& see(const View& view) {
    draw_with_truth(player_, view, {}, tracker_);
    truth_ = traced(traced_surface().carry(player_.proxy_positions()), view);
    return tracker_.now();
  }
  View view(double azimuth, double elevation = 0.1) const {
    return orbit_view(traced_organ().cameras, {azimuth, elevation}, kPixelSide_px, kPixelSide_px);
  }
  // Against what was traced, where it is no outline.
  void expect_exact(const PixelTruth& pixels, const std::string& what) {
    double depth2 = 0, angle = 0;
    std::size_t count = 0, far = 0, covered = 0;
    std::vector<bool> skin(pixels.pixels()), traced_skin(pixels.pixels());
    for (std::size_t i = 0; i < pixels.pixels(); ++i) {
      skin[i] = pixels.label[i] == kFirstOrganLabel;
      traced_skin[i] = truth_.covered(i);
      if (!skin[i] || !truth_.covered(i)) continue;
      const double off = std::abs(double(pixels.depth_mm[i]) - truth_.depth_mm[i]);
      ++covered, far += off > kFarOff_mm;
      if (truth_.outline[i]) continue;
      ++count, depth2 += off * off;
      angle +=
          std::acos(std::clamp(pixels.normal[i].cast<double>().dot(truth_.normal[i]), -1., 1.));
    }
    ASSERT_GT(count, 20000u) << what;
    const double rms = std::sqrt(depth2 / double(count)), share = double(far) / double(covered),
                 normals = angle / double(count) * 57.29578,
                 iou = intersection_over_union(skin, traced_skin);
    RecordProperty(what, "depth " + std::to_string(rms) + " mm, normals " +
                             std::to_string(normals) + " degrees, mask " + std::to_string(iou));
    EXPECT_LE(rms, kDepthRms_mm) << what;
    EXPECT_LE(share, kFarOffShare) << what;
    EXPECT_LE(normals, kNormals_deg) << what;
    EXPECT_GE(iou, kMaskIou) << what;
  }

  Player player_{traced_organ()};
  TruthTracker tracker_{layers_from("all")};
  Traced truth_;
};

TEST_F(PixelTruthTest, IsWhatRaysMeetAtRest) {
  for (const double azimuth : {0.0, 0.4, 1.9, -1.1})
    expect_exact(see(view(azimuth)), "rest " + std::to_string(azimuth));
}

TEST_F(PixelTruthTest, IsWhatRaysMeetUnderAPoke) {
  poke(player_, 12);
  for (const double azimuth : {0.0, 0.7})
    expect_exact(see(view(azimuth)), "poked " + std::to_string(azimuth));
}

TEST_F(PixelTruthTest, MovesWithTheSkin) {
  see(view(0));
  poke(player_, 3);
  const PixelTruth rest = tracker_.now();
  draw_with_truth(player_, view(0), {}, tracker_);
  double worst = 0;
  for (std::size_t i = 0; i < rest.pixels(); ++i)
    if (rest.label[i] && tracker_.now().label[i])
      worst = std::max(worst, std::abs(double(rest.depth_mm[i]) - tracker_.now().depth_mm[i]));
  EXPECT_GT(worst, 2);
}

// The skin point of each pixel, carried, lies where the pixel looks; of pixels that hold several
// texels, too.
TEST_F(PixelTruthTest, TellsTheSkinPointThatAPixelShows) {
  poke(player_, 8);
  for (const int side_px : {kPixelSide_px, kPixelSide_px / 3}) {
    const View from = orbit_view(traced_organ().cameras, {0.2, 0.1}, side_px, side_px);
    const PixelTruth& pixels = see(from);
    const auto shells = traced_organ().shell().posed_matrices(player_.proxy_positions());
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < pixels.pixels(); ++i) {
      if (pixels.label[i] == 0 || truth_.outline[i]) continue;
      const BoundPixel& b = pixels.bound[i];
      const Eigen::Vector3d p = shell_point(shells[b.face], b.b1, b.b2, b.height_mm);
      const Eigen::Vector2d center(i % side_px + 0.5, i / side_px + 0.5);
      sum += (project(from.camera, p) - center).norm();
      ++count;
    }
    constexpr double kMean_px = 0.1;
    EXPECT_LT(sum / double(count), kMean_px) << side_px;
  }
}

TEST_F(PixelTruthTest, HasToolsWhereTheirFormulaSays) {
  const View from = view(0);
  const Eigen::Vector3d eye = from.camera.center_world_mm(),
                        center = traced_organ().cameras.manifold.center_world_mm;
  Solid ball;
  ball.from = ball.to = center + 0.5 * (eye - center);
  ball.radius_mm = 12;
  ball.instrument = 3;
  draw_with_truth(player_, from, {ball}, tracker_);
  const PixelTruth& pixels = tracker_.now();
  const Eigen::Vector3d middle = from.camera.camera_from_world * ball.from;
  std::size_t tool = 0;
  for (std::size_t i = 0; i < pixels.pixels(); ++i) {
    const Eigen::Vector3d ray =
        unproject(from.camera.intrinsics, {i % kPixelSide_px + 0.5, i / kPixelSide_px + 0.5});
    const double a = ray.squaredNorm(), b = ray.dot(middle),
                 d = b * b - a * (middle.squaredNorm() - ball.radius_mm * ball.radius_mm);
    EXPECT_EQ(pixels.label[i] == kFirstToolLabel + 3, d >= 0) << i;
    if (d < 0) continue;
    ++tool;
    const double depth = (b - std::sqrt(d)) / a;
    EXPECT_NEAR(pixels.depth_mm[i], depth, 1e-3);
    const Eigen::Vector3d normal = (depth * ray - middle).normalized();
    EXPECT_GT(pixels.normal[i].cast<double>().dot(normal), 1 - 1e-5);
  }
  EXPECT_GT(tool, 500u);
}

TEST_F(PixelTruthTest, IsTheSameForAnyNumberOfThreads) {
  see(view(0.3));
  const PixelTruth many = tracker_.now();
  const ThreadLimit one(1);
  TruthTracker alone(layers_from("all"));
  draw_with_truth(player_, view(0.3), {}, alone);
  EXPECT_EQ(many.depth_mm, alone.now().depth_mm);
  EXPECT_EQ(many.label, alone.now().label);
  EXPECT_EQ(many.normal, alone.now().normal);
}

TEST_F(PixelTruthTest, LabelsOrgansApart) {
  Bundle other = traced_organ();
  const Eigen::Vector3d aside(0, -40, 60);
  for (auto& v : other.proxy.vertices) v += aside;
  for (PosedCamera& c : other.cameras.cameras)
    c.camera_from_world.translation -= c.camera_from_world.rotation * aside;
  other.cameras.manifold.center_world_mm += aside;
  Player two(std::vector<Bundle>{traced_organ(), other});
  draw_with_truth(two, view(0), {}, tracker_);
  const PixelTruth& both = tracker_.now();
  const auto count = [&](int label) {
    return std::count(both.label.begin(), both.label.end(), label);
  };
  EXPECT_GT(count(1), 2000);
  EXPECT_GT(count(2), 2000);
  EXPECT_EQ(count(0) + count(1) + count(2), long(both.pixels()));
  for (std::size_t i = 0; i < both.pixels(); ++i)
    EXPECT_TRUE(both.label[i] == 0 || both.organ_at(i) + 1 == both.label[i]) << i;
}

TEST_F(PixelTruthTest, AsksForBoundPixels) {
  Frame frame;
  player_.draw(view(0), {}, frame);
  EXPECT_TRUE(frame.bound.empty());
  EXPECT_THROW(tracker_.advance(player_, view(0), {}, frame), UsageError);
}

// Asking for the truth changes no picture.
TEST_F(PixelTruthTest, LeavesThePictureAsItIs) {
  Frame plain;
  player_.draw(view(0.5), {}, plain);
  EXPECT_EQ(plain.color.pixels, draw_with_truth(player_, view(0.5), {}, tracker_).pixels);
}

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
