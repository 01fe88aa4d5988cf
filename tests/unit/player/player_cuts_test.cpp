// SPDX-License-Identifier: Apache-2.0

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/cutting/cut_skin.h"
#include "organbake/player/live_session.h"
#include "organbake/player/player.h"
#include "organbake/warp/paper_warp.h"
#include "organs_to_play.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

void cut_in_two(Player& player) {
  for (int i = 0; i <= 60; ++i) player.step({blade_at(i / 60.0)});
  let_part(player);
}

TEST(PlayerCuts, SpringsAreRefusedAndSaySo) {
  Player player(organ_to_cut(), {.solver = TissueSolver::springs});
  EXPECT_THAT(message_of(ExitCode::usage, [&] { player.step({blade_at(0.5)}); }),
              testing::HasSubstr("solver fem"));
}

TEST(PlayerCuts, ABladeNeedsAnEdge) {
  Player player(organ_to_cut(), with_fem());
  Instrument tip = blade_at(0.5);
  tip.axis_mm.setZero();
  EXPECT_THROW(player.step({tip}), UsageError);
  Script script = cutting_script();
  script.instruments[0].instrument.axis_mm.setZero();
  EXPECT_THROW(script_from_json(script_to_json(script), "script"), BadDataError);
}

TEST(PlayerCuts, APieceIsCutFreeAndCarriedAway) {
  Player player(organ_to_cut(), with_fem());
  cut_in_two(player);
  ASSERT_TRUE(player.is_cut());
  ASSERT_EQ(player.piece_count(), 2u);
  Vector3d end = Vector3d::Constant(-1e9);
  for (const Vector3d& v : player.proxy_positions())
    if (v.x() > end.x()) end = v;
  const auto grab_at = [&](double share) {
    Instrument tip;
    tip.active = true;
    tip.kind = Grasper{};
    tip.radius_mm = 5;
    tip.position_mm = end + Vector3d(2 + 80 * share, 0, 0);
    return tip;
  };
  StepReport report;
  for (int i = 0; i <= 120; ++i) {
    report = player.step({grab_at(i / 120.0)});
    ASSERT_FALSE(report.recovered);
  }
  for (int i = 0; i < 60; ++i) report = player.step({grab_at(1)});
  // What was carried came along as a whole, the rest stayed.
  const double cut_x = blade_at(0).position_mm.x();
  const Bundle& now = player.bundle_now();
  double least_carried = 1e9, most_left = -1e9;
  for (std::size_t v = 0; v < now.proxy.vertices.size(); ++v) {
    const double moved = (player.proxy_positions()[v] - now.proxy.vertices[v]).x();
    const double beside = now.proxy.vertices[v].x() - cut_x;
    if (beside > 1) least_carried = std::min(least_carried, moved);
    if (beside < -1) most_left = std::max(most_left, moved);
  }
  EXPECT_GT(least_carried, 60);
  EXPECT_LT(most_left, 5);
  EXPECT_LT(report.tip_force_n[0].norm(), 1);
}

// The middle of the piece that is cut off, by the proxy's vertices beyond the blade's plane at
// rest.
Vector3d middle_of_piece(const Player& player) {
  const TriangleMesh& rest = player.bundle_now().proxy;
  const double cut_x = blade_at(0).position_mm.x();
  Vector3d sum = Vector3d::Zero();
  std::size_t count = 0;
  for (std::size_t v = 0; v < rest.vertices.size(); ++v)
    if (rest.vertices[v].x() > cut_x + 1) sum += player.proxy_positions()[v], ++count;
  return sum / double(count);
}

// It stands still between the tool and the organ, which gives way; left alone it comes to rest.
TEST(PlayerCuts, AFreePieceStopsAtTheOrganAndComesToRest) {
  constexpr int kPushed = 20, kUntouched = 30;
  constexpr double kPush_mm = 10;    // farther, the organ gives way beyond the cut's old place
  constexpr double kThrough_mm = 1;  // a fifteenth of a tetrahedron, while a tool presses
  constexpr double kSlowedTo = 0.4;  // of its speed; the cavity alone leaves 0.22
  Player player(organ_to_cut(), with_fem());
  cut_in_two(player);
  ASSERT_EQ(player.piece_count(), 2u);
  const Vector3d middle = middle_of_piece(player);
  const double cut_x = blade_at(0).position_mm.x();
  StepReport report;
  std::size_t contacts = 0;
  Vector3d before = middle;
  for (int i = 0; i <= kPushed; ++i) {
    Instrument tip;
    tip.active = true;
    tip.radius_mm = 6;
    tip.position_mm = middle + Vector3d(40 - kPush_mm * i / kPushed, 0, 0);
    before = middle_of_piece(player);
    report = player.step({tip});
    contacts = std::max(contacts, report.tissue_contacts);
    ASSERT_LT(report.tissue_penetration_mm, kThrough_mm) << i;
    ASSERT_GT(middle_of_piece(player).x(), cut_x) << i;
  }
  EXPECT_GT(contacts, 3u);
  double fastest = (middle_of_piece(player) - before).norm();
  for (int i = 0; i < kUntouched; ++i) {
    before = middle_of_piece(player);
    player.step({});
    fastest = std::max(fastest, (middle_of_piece(player) - before).norm());
  }
  EXPECT_LT((middle_of_piece(player) - before).norm(), kSlowedTo * fastest);
  EXPECT_GT(middle_of_piece(player).x(), cut_x);
}

TEST(PlayerCuts, ResetMakesItWhole) {
  Player player(organ_to_cut(), with_fem());
  const Script still = short_script(0);
  const std::vector<std::uint8_t> before = bytes_of(player, still);
  cut_in_two(player);
  player.reset();
  EXPECT_FALSE(player.is_cut());
  EXPECT_EQ(player.proxy_positions().size(), organ_to_cut().proxy.vertices.size());
  EXPECT_EQ(bytes_of(player, still), before);
}

// From springs to tetrahedra and, cut in two, back: each plays as a player made for it does.
TEST(PlayerCuts, ChangesItsSolver) {
  const DeformOptions by_choice = {.solver = TissueSolver::springs};
  Player player(organ_to_cut(), by_choice), springs(organ_to_cut(), by_choice),
      elements(organ_to_cut());
  const Script poke = short_script(6);
  const std::vector<std::uint8_t> by_springs = bytes_of(springs, poke);
  EXPECT_EQ(bytes_of(player, poke), by_springs);
  player.set_solver(TissueSolver::fem);
  EXPECT_EQ(bytes_of(player, poke), bytes_of(elements, poke));
  cut_in_two(player);
  ASSERT_EQ(player.piece_count(), 2u);
  player.set_solver(TissueSolver::springs);
  EXPECT_FALSE(player.is_cut());
  EXPECT_EQ(bytes_of(player, poke), by_springs);

  Player without(organ_to_play());
  EXPECT_THROW(without.set_solver(TissueSolver::fem), UsageError);
  EXPECT_EQ(without.solver(), TissueSolver::springs);
  EXPECT_EQ(bytes_of(without, poke), by_springs);
}

TEST(PlayerCuts, ReplaysToTheLastBit) {
  Player player(organ_to_cut(), with_fem()), other(organ_to_cut(), with_fem());
  const std::vector<std::uint8_t> once = bytes_of(player, cutting_script());
  EXPECT_EQ(player.piece_count(), 2u);
  EXPECT_EQ(bytes_of(player, cutting_script()), once);
  EXPECT_EQ(bytes_of(other, script_from_json(script_to_json(cutting_script()), "s")), once);
}

// Whenever cuts were worked out.
TEST(PlayerCuts, ALiveCutReplaysToTheLastBit) {
  for (const bool when_ready : {false, true}) {
    Player player(organ_to_cut(), with_fem());
    if (when_ready) player.set_cut_times(Player::CutTimes{});
    LiveSession session(player, 1.0 / 60);
    session.advance(false, 160, 120, {});
    ASSERT_TRUE(session.touch({60, 60}, Blade{}));
    std::vector<std::uint8_t> live;
    for (int i = 0; i < 30 || !player.is_cut(); ++i) {
      session.drag({60 + 1.5 * std::min(i, 30), 60});
      session.advance(true, 160, 120, {});
      const auto& pixels = session.frame().color.pixels;
      live.insert(live.end(), pixels.begin(), pixels.end());
    }
    const Script record = script_from_json(script_to_json(session.record("live")), "s");
    ASSERT_EQ(record.cuts_part_in.has_value(), when_ready);
    Player again(organ_to_cut(), with_fem());
    EXPECT_EQ(bytes_of(again, record), live);
    if (!when_ready) continue;
    EXPECT_FALSE(record.cuts_part_in->empty());
    Script later = record;  // in another step it looks otherwise
    for (std::uint32_t& step : *later.cuts_part_in) ++step;
    EXPECT_NE(bytes_of(again, later), live);
  }
}

// Skin that a grasper holds has given way beyond its tissue, and stays in its jaws as a cut begins.
TEST(PlayerCuts, HeldSkinStaysWhereItIsWhenACutBegins) {
  Bundle organ = organ_to_cut();
  organ.mechanics.body->give_mm_per_n.assign(organ.proxy.vertices.size(), 3);
  organ.mechanics.grasp_slip_n = 0;
  const Vector3d middle = bounds(organ.proxy).center();
  const auto site = *std::min_element(organ.proxy.vertices.begin(), organ.proxy.vertices.end(),
                                      [&](const Vector3d& a, const Vector3d& b) {
                                        return (a - middle - Vector3d(0, 0, -60)).norm() <
                                               (b - middle - Vector3d(0, 0, -60)).norm();
                                      });
  Player player(organ, with_fem());
  Instrument grasper;
  grasper.active = true;
  grasper.kind = Grasper{};
  const auto from_jaws_mm = [&] {
    double nearest = 1e9;
    for (const Vector3d& v : player.proxy_positions())
      nearest = std::min(nearest, (v - grasper.position_mm).norm());
    return nearest;
  };
  double held_mm = 0;
  StepReport report;
  for (int step = 0; step < 120; ++step) {
    grasper.position_mm = site + Vector3d(0, 0, -std::min(8.0, 0.2 * step));
    std::vector<Instrument> tools = {grasper};
    if (step >= 80) tools.push_back(blade_at((step - 80) / 40.0));
    report = player.step(tools);
    if (!player.is_cut()) held_mm = from_jaws_mm();
    if (step > 0) {
      ASSERT_LT(from_jaws_mm(), held_mm + 0.3) << step;
    }
  }
  EXPECT_TRUE(player.is_cut());
  EXPECT_GT(report.tip_force_n[0].norm(), 0.3);  // what gives way gave way by millimetres
}

// A cut that nothing pulls on is a thin wet line: elsewhere the picture is that of the whole organ.
TEST(PlayerCuts, ACutAtRestChangesNoMoreThanItsLine) {
  Bundle lit = organ_to_cut();
  lit.lighting.emplace();
  lit.lighting->ambient_above.setConstant(0.6), lit.lighting->ambient_below.setConstant(0.6);
  Player player(std::move(lit), with_fem());
  const View view = orbit_view(organ_to_cut().cameras, {0.1, 0.1, 1}, 320, 240);
  DrawOptions at_scope;
  at_scope.light = DrawnLight::scope;
  Frame whole, cut, whole_at_scope, cut_at_scope;
  player.draw(view, {}, whole);
  const View near = orbit_view(organ_to_cut().cameras, {0.1, 0.1, 0.4}, 320, 240);
  player.draw(near, at_scope, whole_at_scope);
  for (int i = 0; i <= 40; ++i) {
    Instrument tip = blade_at(0.5);
    tip.position_mm = bounds(organ_to_cut().proxy).center() + Vector3d(-20 + i, 0, 0);
    tip.axis_mm = 120 * organ_to_cut().cameras.manifold.directions.front();
    player.step({tip});
  }
  let_part(player);
  ASSERT_TRUE(player.is_cut());
  player.draw(view, {}, cut);
  player.draw(near, at_scope, cut_at_scope);
  std::size_t differ = 0;
  std::size_t same = 0;  // by the light at the scope: its exposure is the whole organ's
  for (std::size_t i = 0; i < whole.color.pixels.size(); ++i) {
    differ += std::abs(int(whole.color.pixels[i]) - int(cut.color.pixels[i])) > 40;
    same += std::abs(int(cut_at_scope.color.pixels[i]) - int(whole_at_scope.color.pixels[i])) <= 1;
  }
  EXPECT_LT(double(differ), 0.006 * double(whole.color.pixels.size()));
  EXPECT_GT(double(same), 0.6 * double(whole.color.pixels.size()));
}

TEST(PlayerCuts, TheProxyOfACutOrganIsTold) {
  Player player(organ_to_cut(), with_fem());
  cut_in_two(player);
  EXPECT_EQ(player.bundle_now().proxy.vertices.size(), player.proxy_positions().size());
  EXPECT_GT(player.bundle_now().proxy.faces.size(), organ_to_cut().proxy.faces.size());
  player.draw_by(std::make_shared<PaperWarp>(organ_to_cut()));
  Frame frame;
  EXPECT_THROW(player.draw(orbit_view(organ_to_cut().cameras, {}, 64, 64), {}, frame), UsageError);
}

constexpr double kHalf_mm = 15, kDeep_mm = 12;

// A blade that is drawn across the front, 30 mm along x.
Instrument blade_in_front(double share) {
  const SyntheticOrgan& organ = organ_options().organ;
  Instrument tip;
  tip.active = true;
  tip.kind = Blade{};
  tip.radius_mm = 0.4;
  tip.axis_mm = Vector3d(0, -30, 0);
  tip.position_mm = organ.center + Vector3d(kHalf_mm * (2 * share - 1), 0, 4);
  tip.position_mm.y() -= organ.radius({0, -1, 0}) - kDeep_mm;
  return tip;
}

// Where the cut runs on the skin, by the organ's formula.
Vector3d on_skin(double share) {
  const Vector3d tip = blade_in_front(share).position_mm, outside = tip - Vector3d(0, 100, 0);
  return outside + organ_options().organ.trace(outside, {0, 1, 0}) * Vector3d(0, 1, 0);
}

Player& cut_in_front() {
  static Player player = [] {
    Player made(organ_to_cut(), with_fem());
    for (int i = 0; i <= 30; ++i) made.step({blade_in_front(i / 30.0)});
    let_part(made);
    return made;
  }();
  return player;
}

double brightness(const Frame& frame, const Eigen::Vector2d& px) {
  const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
  if (x < 0 || y < 0 || x >= frame.color.width || y >= frame.color.height) return 0;
  const std::uint8_t* rgb = frame.color.at(x, y);
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

// Of the darkest place within the gape about a place of the cut to the skin on both its sides.
double contrast_at(const Frame& frame, const View& view, double share) {
  const Vector3d at = on_skin(share), aside(0, 0, 1);
  const auto seen = [&](double mm) {
    return brightness(frame, project(view.camera, at + mm * aside));
  };
  double line = 255, skin = 0;
  for (double mm = -1; mm <= 1; mm += 0.05) line = std::min(line, seen(mm));
  int places = 0;
  for (double mm = 2.5; mm <= 5; mm += 0.25) skin += seen(mm) + seen(-mm), places += 2;
  return 1 - line / (skin / places);
}

// From 50 to 120 mm, up to 35° from straight above, turned in any way.
View view_of_cut(RandomStream& random) {
  const double slant = random.uniform(0, 35) * std::numbers::pi / 180,
               turn = random.uniform(0, 2 * std::numbers::pi);
  const Vector3d to_eye(std::sin(slant) * std::cos(turn), -std::cos(slant),
                        std::sin(slant) * std::sin(turn));
  const Vector3d middle = on_skin(0.5), up = {random.uniform(-1, 1), 0, random.uniform(0.1, 1)};
  View view;
  view.camera.camera_from_world = look_at(middle + random.uniform(50, 120) * to_eye, middle, up);
  view.camera.intrinsics = {640, 480, 620, 620, 320, 240};
  return view;
}

TEST(LipGape, ACutAtRestShowsInTwentyOfTwentyViews) {
  Player& player = cut_in_front();
  ASSERT_TRUE(player.is_cut());
  RandomStream random(5);
  std::vector<double> shares;  // of the cut, by view
  for (int i = 0; i < 20; ++i) {
    const View view = view_of_cut(random);
    Frame frame;
    player.draw(view, {}, frame);
    int dark = 0, places = 0;
    double least = 1;
    for (double share = 0.02; share < 0.98; share += 0.01, ++places) {
      const double contrast = contrast_at(frame, view, share);
      dark += contrast >= 0.3;
      if (share > 0.05 && share < 0.95) least = std::min(least, contrast);
    }
    std::printf("view %d: %.1f %% of the cut with contrast 0.3, least %.2f\n", i,
                100.0 * dark / places, least);
    shares.push_back(double(dark) / places);
  }
  EXPECT_GE(*std::min_element(shares.begin(), shares.end()), 0.95);
}

// Between lips, far from the cut's ends: what the pose that is drawn adds to the tissue's own.
TEST(LipGape, GapesAsWideAsASkinsTensionPullsAndMovesNoTissue) {
  Player& player = cut_in_front();
  std::vector<Vector3d> drawn = player.proxy_positions();
  const std::vector<Vector3d> tissue = drawn;
  ASSERT_TRUE(player.gape());
  player.gape()->open(drawn);
  EXPECT_EQ(player.proxy_positions(), tissue);
  const Vector3d middle = on_skin(0.5);
  double below = 0, above = 0, farthest = 0;
  for (std::size_t v = 0; v < drawn.size(); ++v) {
    const Vector3d moved = drawn[v] - tissue[v];
    farthest = std::max(farthest, moved.norm());
    if (std::abs((tissue[v] - middle).x()) > 8 || (tissue[v] - middle).norm() > 10) continue;
    below = std::min(below, moved.z()), above = std::max(above, moved.z());
  }
  EXPECT_GE(above - below, 0.5);
  EXPECT_LE(above - below, 2);
  EXPECT_LE(farthest, 0.5 * organ_to_cut().mechanics.cut_gape_mm + 1e-9);
}

}  // namespace
}  // namespace organbake
