// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/eye_inside.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "organ_to_play.h"
#include "organbake/player/play.h"

namespace organbake {
namespace {

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

}  // namespace
}  // namespace organbake
