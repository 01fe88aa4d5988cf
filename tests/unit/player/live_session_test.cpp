// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/live_session.h"

#include "organbake/warp/organ_source.h"
#include "organs_to_play.h"
#include "support/testing.h"

namespace organbake {
namespace {

constexpr double kStep_s = 1.0 / 60;
constexpr int kWidth = 160, kHeight = 120;
const Eigen::Vector2d kMiddle(kWidth / 2.0, kHeight / 2.0);

// A session that has drawn its first picture, so that the pointer has something to meet.
struct Seen {
  Player player{organ_to_play()};
  LiveSession session{player, kStep_s};

  Seen() { advance(false); }
  PlayedFrame advance(bool step = true) { return session.advance(step, kWidth, kHeight, {}); }
  Eigen::Vector2d place_of(const Eigen::Vector3d& world_mm) const {
    return project(session.view().camera, world_mm);
  }
};

TEST(LiveSession, TheOrganFollowsThePointer) {
  Seen s;
  const Eigen::Vector3d center = organ_to_play().cameras.manifold.center_world_mm;
  s.session.shift({12, -7});
  s.advance();
  EXPECT_LT((s.place_of(center) - kMiddle - Eigen::Vector2d(12, -7)).norm(), 1e-6);

  Seen t;
  const Eigen::Vector3d toward_eye =
      (t.session.view().camera.center_world_mm() - center).normalized();
  const Eigen::Vector3d front = center + 40 * toward_eye;
  t.session.turn({10, 0});
  t.advance();
  EXPECT_GT(t.place_of(front).x(), kMiddle.x() + 1);
  EXPECT_NEAR(t.place_of(front).y(), kMiddle.y(), 0.5);

  Seen u;
  u.session.turn({0, 10});
  u.advance();
  EXPECT_GT(u.place_of(front).y(), kMiddle.y() + 1);
}

TEST(LiveSession, ZoomStopsBeforeTheOrganAndBeforeItVanishes) {
  Seen s;
  const double before = s.session.view().camera.camera_from_world.translation.norm();
  s.session.zoom(1);
  s.advance();
  EXPECT_LT(s.session.view().camera.camera_from_world.translation.norm(), before);
  for (const double steps : {1e4, -1e4}) {
    s.session.zoom(steps);
    EXPECT_NO_THROW(s.advance());
  }
}

TEST(LiveSession, TheToolMeetsTheTissueUnderThePointer) {
  Seen s;
  EXPECT_FALSE(s.session.touch({2, 2}, Ball{}));  // the background
  EXPECT_FALSE(s.session.touch({-5, 1e9}, Ball{}));
  ASSERT_TRUE(s.session.touch(kMiddle, Ball{}));
  EXPECT_NEAR(s.advance().step.penetration_mm, 0, 0.5);
  EXPECT_NEAR(s.session.depth_mm(), 0, 1e-9);
  s.session.drag(kMiddle + Eigen::Vector2d(0, 20));
  const PlayedFrame pressed = s.advance();
  EXPECT_GT(s.session.depth_mm(), 5);
  EXPECT_GT(pressed.step.contacts, 0u);
  // The tissue pushes back towards the eye.
  const Eigen::Vector3d sight = s.session.view().camera.view_direction_world();
  EXPECT_LT(pressed.step.tip_force_n.back().dot(sight), 0);
  s.session.let_go();
  EXPECT_EQ(s.advance().step.contacts, 0u);
}

TEST(LiveSession, AGrabCarriesTissueTheWayThePointerGoes) {
  Seen s;
  ASSERT_TRUE(s.session.touch(kMiddle, Grasper{}));
  s.advance();
  const auto before = s.player.proxy_positions();
  for (int i = 1; i <= 20; ++i) {
    s.session.drag(kMiddle + Eigen::Vector2d(i, 0));
    s.advance();
  }
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  for (std::size_t v = 0; v < before.size(); ++v) {
    const Eigen::Vector3d by = s.player.proxy_positions()[v] - before[v];
    if (by.norm() > moved.norm()) moved = by;
  }
  EXPECT_GT(moved.dot(s.session.view().camera.camera_from_world.rotation.row(0)), 2);
}

TEST(LiveSession, WhatWasDonePlaysBackBitForBit) {
  Seen s;
  std::vector<std::vector<Eigen::Vector3d>> positions;
  std::vector<Rgb8Image> pictures;
  for (int i = 0; i < 50; ++i) {
    if (i % 17 == 3) {
      const InstrumentKind kind = i > 30 ? InstrumentKind(Grasper{}) : Ball{};
      ASSERT_TRUE(s.session.touch(kMiddle + Eigen::Vector2d(i % 5, 3), kind));
    }
    s.session.drag(kMiddle + Eigen::Vector2d(10 * std::sin(0.3 * i), 0.4 * i));
    if (i % 17 == 14) s.session.let_go();
    if (i % 4 == 0) s.session.turn({1.7, -0.6});
    if (i == 20) s.session.shift({3, 4}), s.session.zoom(0.5);
    s.advance(false);  // time that stands still leaves no trace
    s.advance();
    positions.push_back(s.player.proxy_positions());
    pictures.push_back(s.session.frame().color);
  }
  const std::string text = script_to_json(s.session.record("test"));
  const Script script = script_from_json(text, "record");
  ASSERT_EQ(script.frames, 50);
  EXPECT_EQ(script.instruments.size(), 3u);
  Player again(organ_to_play());
  play(again, script, {}, [&](int i, const Frame& frame) {
    EXPECT_EQ(again.proxy_positions(), positions[i]) << "step " << i;
    EXPECT_EQ(frame.color.pixels, pictures[i].pixels) << "step " << i;
  });
}

TEST(LiveSession, ResetForgetsWhatWasDone) {
  Seen s;
  const auto rest = s.player.proxy_positions();
  ASSERT_TRUE(s.session.touch(kMiddle, Ball{}));
  s.session.drag(kMiddle + Eigen::Vector2d(0, 30));
  s.advance();
  s.session.reset();
  EXPECT_EQ(s.player.proxy_positions(), rest);
  EXPECT_FALSE(s.session.holds());
  EXPECT_EQ(s.session.recorded_steps(), 0u);
  EXPECT_TRUE(s.session.record("empty").instruments.empty());
}

// Two touches, each followed by rest.
struct TwoTouches : Seen {
  std::vector<std::vector<Eigen::Vector3d>> positions;  // after each step
  std::size_t second = 0;                               // its first step

  TwoTouches() {
    for (const double down_px : {20.0, 34.0}) {
      second = session.position();
      EXPECT_TRUE(session.touch(kMiddle, Ball{}));
      for (int i = 0; i < 15; ++i) {
        if (i < 8) session.drag(kMiddle + Eigen::Vector2d(0, down_px * (i + 1) / 8));
        if (i == 10) session.let_go();
        step();
      }
    }
  }
  void step() {
    advance();
    positions.push_back(player.proxy_positions());
  }
  void arrive() {
    while (session.seeking()) advance();
  }
};

TEST(LiveSession, UndoBringsTheOrganBackToBeforeTheTouchAndRedoBehindIt) {
  TwoTouches s;
  ASSERT_TRUE(s.session.can_undo());
  EXPECT_FALSE(s.session.can_redo());
  s.session.undo();
  EXPECT_FALSE(s.session.seeking());  // it is there at once
  EXPECT_EQ(s.session.position(), s.second);
  EXPECT_EQ(s.player.proxy_positions(), s.positions[s.second - 1]);
  s.advance();  // time stands still there
  EXPECT_EQ(s.session.position(), s.second);
  s.session.undo();
  s.arrive();
  EXPECT_EQ(s.player.proxy_positions(), s.player.bundle().proxy.vertices);
  EXPECT_FALSE(s.session.can_undo());
  s.session.redo();
  s.session.redo();  // while it is still on its way
  s.arrive();
  EXPECT_EQ(s.player.proxy_positions(), s.positions.back());
  EXPECT_FALSE(s.session.can_redo());
}

TEST(LiveSession, MomentsToGoBackToFitIntoTheirMemory) {
  Player player(organ_to_play());
  const auto step_with = [&](double depth_mm) {
    Instrument tip;
    tip.active = true;
    tip.position_mm = bounds(organ_to_play().proxy).center() + Eigen::Vector3d(0, 0, depth_mm);
    player.step({tip});
  };
  player.step({});
  const std::size_t one = player.save_state().bytes_beside({});
  SessionStates states(20 * one);
  constexpr std::size_t kSteps = 400, kTouch = 37;
  for (std::size_t s = 1; s <= kSteps; ++s) {
    states.keep(player.save_state(states.before(s)), s % kTouch == 0);
    EXPECT_LE(states.bytes(), 20 * one);
    step_with(30 + double(s % 20));
  }
  EXPECT_GT(states.count(), 15u);
  for (std::size_t s = kTouch; s <= kSteps; s += kTouch) EXPECT_TRUE(states.has(s)) << s;
  EXPECT_TRUE(states.has(1));
  EXPECT_TRUE(states.has(kSteps));
  EXPECT_EQ(states.before(kTouch).steps(), kTouch);
  states.forget_after(kTouch);
  EXPECT_EQ(states.before(kSteps).steps(), kTouch);
  states.clear();
  EXPECT_EQ(states.bytes(), 0u);
  EXPECT_FALSE(states.before(kSteps));
}

TEST(LiveSession, ATouchInThePastForgetsWhatFollowedAndTheRecordStillPlaysBack) {
  TwoTouches s;
  s.session.seek(s.second + 5);  // the second tool is still held there
  s.arrive();
  EXPECT_EQ(s.player.proxy_positions(), s.positions[s.second + 4]);
  s.positions.resize(s.second + 5);
  s.advance(false);
  ASSERT_TRUE(s.session.touch(kMiddle + Eigen::Vector2d(3, 0), Grasper{}));
  EXPECT_FALSE(s.session.can_redo());
  for (int i = 0; i < 12; ++i) {
    s.session.drag(kMiddle + Eigen::Vector2d(3 + i, 0));
    s.step();
  }
  const Script script = script_from_json(script_to_json(s.session.record("past")), "record");
  ASSERT_EQ(std::size_t(script.frames), s.positions.size());
  EXPECT_EQ(script.instruments.size(), 3u);
  Player again(organ_to_play());
  play(again, script, {}, [&](int i, const Frame&) {
    EXPECT_EQ(again.proxy_positions(), s.positions[i]) << "step " << i;
  });
}

TEST(LiveSession, ReplaysItsRecordAsItWasSeen) {
  TwoTouches s;
  s.session.turn({30, 0});
  s.step();
  const View last = s.session.view();
  s.session.turn({0, 20});
  s.session.replay();
  EXPECT_EQ(s.session.position(), 0u);
  for (const auto& expected : s.positions) {
    ASSERT_TRUE(s.session.replaying());
    s.advance();
    EXPECT_EQ(s.player.proxy_positions(), expected);
  }
  EXPECT_FALSE(s.session.replaying());
  EXPECT_TRUE(s.session.view() == last);
}

TEST(LiveSession, WhatFollowsTheEndOfARecordingIsNoPartOfIt) {
  TwoTouches s;
  s.session.seek(s.second);
  s.arrive();
  s.session.seek(s.session.recorded_steps());
  s.arrive();
  s.session.stop_recording();
  const std::size_t end = s.session.record_end();
  ASSERT_TRUE(s.session.touch(kMiddle, Ball{}));
  for (int i = 0; i < 5; ++i) s.advance();
  EXPECT_FALSE(s.session.records());
  const Script script = s.session.record("stopped");
  EXPECT_EQ(std::size_t(script.frames), end);
  EXPECT_EQ(script.instruments.size(), 2u);
  s.session.reset();
  EXPECT_TRUE(s.session.records());
}

TEST(LiveSession, TheScopeComesAsNearAsAskedAndTheLensSeesAsWide) {
  Seen s;
  const double before = s.session.view_angle_deg();
  for (const double mm : {40.0, 12.0, 3.0}) {
    for (int i = 0; i < 6; ++i) {  // the skin ahead is another one from each place
      s.session.set_scope_distance_mm(mm);
      s.advance(false);
    }
    ASSERT_TRUE(s.session.scope_distance_mm());
    EXPECT_NEAR(*s.session.scope_distance_mm(), mm, 0.05 * mm + 0.2);
  }
  s.session.set_view_angle_deg(before + 20);
  s.advance();
  EXPECT_NEAR(s.session.view_angle_deg(), before + 20, 1e-9);
  const Script script = script_from_json(script_to_json(s.session.record("lens")), "record");
  std::vector<std::uint8_t> played;
  play(s.player, script, {}, [&](int, const Frame& frame) { played = frame.color.pixels; });
  EXPECT_EQ(played, s.session.frame().color.pixels);
}

// As a page's canvas: people see its pictures, frames hold none.
class ElsewhereDrawing : public OrganDrawing {
 public:
  bool shows_pictures() const override { return true; }
  std::string refusal(const std::vector<JointDrawing::Organ>&, const View&,
                      const DrawOptions&) const override {
    return {};
  }
  DrawReport draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
                  const DrawOptions& options, Frame& frame) override {
    EXPECT_FALSE(options.keep_depth);
    Frame shown;
    const DrawReport report = drawing_.draw(organs, view, options, shown);
    frame = {};
    frame.serial = shown.serial;
    return report;
  }

 private:
  JointDrawing drawing_;
};

TEST(LiveSession, MeetsTheTissueOfPicturesThatAppearElsewhere) {
  Seen framed, elsewhere;
  elsewhere.player.draw_by(std::make_shared<ElsewhereDrawing>());
  for (Seen* s : {&framed, &elsewhere}) {
    s->session.turn({14, -9});
    s->advance(false);
  }
  EXPECT_TRUE(elsewhere.session.frame().color.pixels.empty());
  EXPECT_FALSE(elsewhere.session.touch({2, 2}, Ball{}));  // the background
  constexpr double kClose_mm = 0.02;  // where samples lie on their pixels otherwise
  ASSERT_TRUE(framed.session.scope_distance_mm() && elsewhere.session.scope_distance_mm());
  const double before_mm = *framed.session.scope_distance_mm();
  EXPECT_NEAR(*elsewhere.session.scope_distance_mm(), before_mm, kClose_mm);
  for (const Eigen::Vector2d& off : {Eigen::Vector2d(0, 0), {17.5, -12}, {-20, 15}}) {
    for (Seen* s : {&framed, &elsewhere}) {
      ASSERT_TRUE(s->session.touch(kMiddle + off, Ball{}));
      s->session.push(4);
      s->advance();
    }
    EXPECT_NEAR(elsewhere.session.depth_mm(), framed.session.depth_mm(), kClose_mm);
    const auto tip = [](const Seen& s) {
      return s.session.record("touch").instruments.back().path.back().position_mm.value();
    };
    EXPECT_LT((tip(elsewhere) - tip(framed)).norm(), kClose_mm);
    // A tool before the lens does not hide how far the skin is, but for its relief.
    constexpr double kRelief_mm = 2.5;
    for (const Seen* s : {&framed, &elsewhere}) {
      const std::optional<double> ahead_mm = s->session.scope_distance_mm();
      ASSERT_TRUE(ahead_mm);
      if (off.norm() > 0) continue;
      EXPECT_NEAR(*ahead_mm, before_mm + s->session.depth_mm(), kRelief_mm);
    }
    for (Seen* s : {&framed, &elsewhere}) {
      s->session.let_go();
      s->advance();
    }
  }
}

}  // namespace
}  // namespace organbake
