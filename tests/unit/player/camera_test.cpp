// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/orbit.h"

#include "organbake/core/error.h"
#include "organbake/player/embedded_player.h"
#include "organbake/player/panel_layout.h"
#include "organbake/player/script.h"
#include "organs_to_play.h"
#include "support/testing.h"

namespace organbake {
namespace {

TEST(OrbitView, StartsAtCameraZero) {
  const CameraSet& cameras = organ_to_play().cameras;
  const PosedCamera& first = cameras.cameras[0];
  const View view = orbit_view(cameras, {}, first.intrinsics.width, first.intrinsics.height);
  EXPECT_LT((view.camera.center_world_mm() - first.center_world_mm()).norm(), 1e-9);
  EXPECT_NEAR(view.camera.intrinsics.fx, first.intrinsics.fx, 1e-9);
}

TEST(OrbitView, AzimuthTurnsAboutTheVerticalAxis) {
  const CameraSet& cameras = organ_to_play().cameras;
  const Eigen::Vector3d center = cameras.manifold.center_world_mm;
  const Eigen::Vector3d start = orbit_view(cameras, {}, 64, 64).camera.center_world_mm() - center;
  for (const double angle : {0.705723, 2.44881, -1.0}) {
    const Eigen::Vector3d turned =
        orbit_view(cameras, {angle}, 64, 64).camera.center_world_mm() - center;
    const Eigen::Vector3d expected = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * start;
    EXPECT_LT((turned - expected).norm(), 1e-9 * start.norm());
  }
}

TEST(OrbitView, LooksAtTheCentreFromAnywhere) {
  const CameraSet& cameras = organ_to_play().cameras;
  for (const double elevation : {-2.0, -0.5, 0.0, 1.2, 3.0}) {  // beyond the poles it stops at them
    const View view = orbit_view(cameras, {0.3, elevation, 1.5, 0.4}, 200, 100);
    const Eigen::Vector2d middle = project(view.camera, cameras.manifold.center_world_mm);
    EXPECT_LT((middle - Eigen::Vector2d(100, 50)).norm(), 1e-6);
  }
}

// As bundles of laparoscopies have it: cameras in a cone about the view of the frame, whose own
// axes are the world's.
TEST(OrbitView, AScopesViewIsUprightAsFilmed) {
  CameraSet cameras = organ_to_play().cameras;
  cameras.manifold.center_world_mm = {1, 2, 60};
  for (const Eigen::Vector3d& beside : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(12, 0, 0)}) {
    cameras.cameras[0].camera_from_world =
        look_at(Eigen::Vector3d(1, 2, -40) + beside, {1, 2, 60}, Eigen::Vector3d(0, -1, 0));
    const auto upright = [&](const OrbitPose& pose) {
      return orbit_view(cameras, pose, 64, 64).camera.camera_from_world;
    };
    const RigidTransform first = upright({});
    EXPECT_LT((first.rotation - cameras.cameras[0].camera_from_world.rotation).norm(), 1e-9);
    EXPECT_LT((first.translation - cameras.cameras[0].camera_from_world.translation).norm(), 1e-9);
    // Elevation lifts the eye to the picture's top, azimuth moves it across, and both are angles.
    const RigidTransform lifted = upright({0, 0.3}), turned = upright({0.3, 0});
    EXPECT_LT((first * lifted.inverse().translation).y(), -20);
    EXPECT_NEAR((first * lifted.inverse().translation).x(), 0, 1e-9);
    EXPECT_NEAR((first * turned.inverse().translation).y(), 0, 1e-9);
    EXPECT_GT(std::abs((first * turned.inverse().translation).x()), 20);
    EXPECT_LT(turned.rotation(1, 1), 1 + 1e-12);
    EXPECT_GT(turned.rotation(1, 1), 0.99);  // y stays down
  }
}

TEST(OrbitView, TellsWhereItStopsAtAPole) {
  const CameraSet& cameras = organ_to_play().cameras;
  constexpr double kTurn_rad = 2 * std::numbers::pi;
  EXPECT_FALSE(leads_past_pole(cameras, {}));
  EXPECT_FALSE(leads_past_pole(cameras, {kTurn_rad, 0.1}));
  EXPECT_TRUE(leads_past_pole(cameras, {0, 0.49 * kTurn_rad}));
  EXPECT_TRUE(leads_past_pole(cameras, {0, -0.49 * kTurn_rad}));
}

TEST(OrbitView, RefusesWhatNobodyCanSee) {
  const CameraSet& cameras = organ_to_play().cameras;
  EXPECT_THROW(orbit_view(cameras, {}, 0, 10), UsageError);
  EXPECT_THROW(orbit_view(cameras, {0, 0, 0}, 10, 10), UsageError);
  EXPECT_THROW(orbit_view(cameras, {std::numeric_limits<double>::quiet_NaN()}, 10, 10), UsageError);
}

TEST(Framing, HasAllOrgansInThePictureAndFillsIt) {
  Bundle other = organ_to_play();
  for (Eigen::Vector3d& v : other.proxy.vertices) v += Eigen::Vector3d(-70, 90, 160);
  const Player player(std::vector<Bundle>{organ_to_play(), other});
  for (const auto& [width, height] : {std::pair(200, 200), {300, 200}, {200, 400}}) {
    const View view = orbit_view(player.bundle().cameras, framing_pose(player), width, height);
    double nearest_border = 1;
    for (std::size_t o = 0; o < 2; ++o) {
      for (const Eigen::Vector3d& v : player.bundle(o).proxy.vertices) {
        const Eigen::Vector2d at = project(view.camera, v).array() / Eigen::Array2d(width, height);
        for (const double share : {at.x(), 1 - at.x(), at.y(), 1 - at.y()}) {
          EXPECT_GT(share, 0.04);
          nearest_border = std::min(nearest_border, share);
        }
      }
    }
    EXPECT_TRUE(width != height || nearest_border < 0.06) << nearest_border;
  }
}

TEST(Framing, LeavesOneOrganToItsCameras) {
  const OrbitPose pose = framing_pose(Player(organ_to_play()));
  EXPECT_EQ(pose.distance, 1);
  EXPECT_EQ(pose.right, 0);
}

using Eigen::Vector3d;

Vector3d center_mm() { return organ_to_play().cameras.manifold.center_world_mm; }

View looking(const Vector3d& eye_mm, const Vector3d& along) {
  View view = orbit_view(organ_to_play().cameras, {}, 60, 45);
  view.camera.camera_from_world = look_at(eye_mm, eye_mm + along, up_from(along));
  return view;
}

std::optional<std::string> said_of(Player& player, const View& view, bool& empty) {
  Frame frame;
  const DrawReport report = player.draw(view, {}, frame);
  empty = report.sample_pixels + report.base_pixels == 0;
  return why_empty(player, view, report);
}

TEST(EyeInside, IsToldFromOutside) {
  const Player player(organ_to_play());
  const double far_mm = (organ_to_play().cameras.cameras[0].center_world_mm() - center_mm()).norm();
  for (const Vector3d& along : {Vector3d(1, 0, 0), Vector3d(0.3, -1, 0.2), Vector3d(0, 0, 1)}) {
    EXPECT_TRUE(eye_is_inside(player, looking(center_mm() + 3 * along, along)));
    EXPECT_FALSE(eye_is_inside(player, looking(center_mm() + far_mm * along, -along)));
  }
}

// Through the skin of several faces, from outside to inside and along the normal. The relief stands
// by some millimetres over some of them.
TEST(EyeInside, NoPictureIsEmptyInSilenceOnTheWayIn) {
  Player player(organ_to_play());
  const TriangleMesh skin = organ_to_play().shell().at_rest();
  std::size_t inside = 0;
  for (std::size_t f = 0; f < skin.faces.size(); f += skin.faces.size() / 6) {
    const auto& [a, b, c] = skin.faces[f];
    const Vector3d at = (skin.vertices[a] + skin.vertices[b] + skin.vertices[c]) / 3;
    const Vector3d normal = (skin.vertices[b] - skin.vertices[a])
                                .cross(skin.vertices[c] - skin.vertices[a])
                                .normalized();
    for (const double above_mm : {30.0, 4.0, 1.0, 0.4, 0.2, 0.05, -0.05, -0.4, -2.0, -15.0}) {
      bool empty = false;
      const auto said = said_of(player, looking(at + above_mm * normal, -normal), empty);
      EXPECT_EQ(empty, said.has_value()) << "face " << f << ", " << above_mm << " mm above";
      EXPECT_FALSE(empty && above_mm > 4);
      if (above_mm > -15 || !empty) continue;  // a neighbouring bulge may be seen
      ASSERT_TRUE(said);
      EXPECT_NE(said->find("the eye is inside the organ"), std::string::npos) << *said;
      EXPECT_NE(said->find("at least 0.25 mm between the lens and the skin"), std::string::npos);
      ++inside;
    }
  }
  EXPECT_GE(inside, 3u);
}

TEST(EyeInside, APictureOfTheGroundBesideTheOrganIsNoFault) {
  Player player(organ_to_play());
  const Vector3d eye = organ_to_play().cameras.cameras[0].center_world_mm();
  bool empty = false;
  EXPECT_FALSE(said_of(player, looking(eye, eye - center_mm()), empty));
  EXPECT_TRUE(empty);
}

TEST(EyeInside, AScriptSaysInWhichFrame) {
  Script script;
  script.frames = 3;
  script.width = 60, script.height = 45;
  script.camera = {{0, {}}, {2, {}}};
  script.camera[1].pose.distance = 0.01;
  std::vector<std::string> said;
  const RunContext context(
      [&](LogLevel level, std::string_view what) {
        if (level == LogLevel::warning) said.emplace_back(what);
      },
      {}, nullptr);
  Player player(organ_to_play());
  play(player, script, {}, {}, context);
  ASSERT_FALSE(said.empty());
  EXPECT_EQ(said.back().find("frame 2: the eye is inside the organ"), 0u) << said.back();
}

namespace fs = std::filesystem;

TEST(BundleList, HasBundlesFirstAndNoHiddenFoldersOrFiles) {
  const fs::path folder = fs::path(testing::TempDir()) / "bundle_list";
  fs::remove_all(folder);
  for (const char* name : {"b", "a", "z_bundle", "y_bundle", ".hidden"})
    fs::create_directories(folder / name);
  for (const char* name : {"z_bundle/manifest.json", "y_bundle/manifest.json", "file"})
    std::ofstream(folder / name) << "{}";
  std::string listed;
  for (const ListedFolder& f : list_folders(folder)) listed += f.name + (f.is_bundle ? "! " : " ");
  EXPECT_EQ(listed, "y_bundle! z_bundle! a b ");
  EXPECT_TRUE(list_folders(folder / "nowhere").empty());
  fs::remove_all(folder);
}

bool overlap(const PixelRect& a, const PixelRect& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

TEST(PanelLayout, FillsTheWindowWithoutAnyOverlap) {
  for (const Eigen::Vector2i& size :
       {Eigen::Vector2i(700, 450), {1280, 720}, {1920, 1080}, {3840, 2160}}) {
    for (int wanted = 0; wanted < 16; ++wanted) {
      const OpenPanels open{(wanted & 1) != 0, (wanted & 2) != 0, (wanted & 4) != 0};
      const double scale = panel_scale(size, 1);
      const PanelLayout l = lay_out_panels(size, scale, open, (wanted & 8) != 0);
      const std::vector<PixelRect> rects = {l.tools, l.readings, l.timeline, l.organ};
      int area = 0;
      for (std::size_t a = 0; a < rects.size(); ++a) {
        area += rects[a].width * rects[a].height;
        for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(overlap(rects[a], rects[b]));
      }
      EXPECT_EQ(area, size.prod());
      EXPECT_GE(l.organ.width, int(scale * kLeastOrgan_px));
      EXPECT_GE(l.organ.height, size.y() / 2);
    }
  }
}

TEST(PanelLayout, FoldsTheSideThatIsNotPreferredWhereBothDoNotFit) {
  for (const bool readings : {false, true}) {
    const OpenPanels open = lay_out_panels({700, 450}, 1, {}, readings).open;
    EXPECT_EQ(open, (OpenPanels{!readings, readings, true}));
    EXPECT_EQ(lay_out_panels({1280, 720}, 1, {}, readings).open, OpenPanels{});
  }
  EXPECT_EQ(lay_out_panels({400, 300}, 1, {}, false).open, (OpenPanels{false, false, true}));
}

TEST(PanelLayout, GrowsWithTheWindowOrAsTheScreenAsks) {
  EXPECT_EQ(panel_scale({1280, 720}, 1), 1);
  EXPECT_EQ(panel_scale({1280, 720}, 1.5), 1.5);
  EXPECT_EQ(panel_scale({3840, 2160}, 1), 2);
}

// What it does with a bundle is tested from outside: tests/cli/consumer.sh.
TEST(EmbeddedPlayer, AMissingBundleIsNamed) {
  EXPECT_THROW(EmbeddedPlayer("no/such/bundle"), NoInputError);
}

TEST(EmbeddedPlayer, ABadTimeStepIsSaidBeforeTheBundleIsRead) {
  EXPECT_THROW(EmbeddedPlayer("no/such/bundle", 0), UsageError);
  EXPECT_THROW(EmbeddedPlayer("no/such/bundle", std::nan("")), UsageError);
}

}  // namespace
}  // namespace organbake
