// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/script.h"

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/player/skin_point.h"
#include "organs_to_play.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

const std::string kGood = R"({
  "schema": "organbake/interaction/1", "name": "n", "time_step_s": 0.02, "frames": 10, "size": [64, 48],
  "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0},
                           {"frame": 8, "azimuth_rad": 1, "elevation_rad": 0.5, "distance": 2}]},
  "instruments": [{"name": "p", "mode": "grab", "radius_mm": 4,
                   "path": [{"time_s": 0, "position_mm": [1, 2, 3]},
                            {"time_s": 1, "direction": [0, 1, 0], "depth_mm": 5}]}]})";

std::string refusal(const std::string& from, const std::string& to) {
  std::string text = kGood;
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return message_of(ExitCode::bad_data,
                    [&] { script_from_json(text.replace(at, from.size(), to), "s.json"); });
}

TEST(Script, IsReadWhole) {
  const Script s = script_from_json(kGood, "s.json");
  EXPECT_EQ(s.frames, 10);
  EXPECT_EQ(s.width, 64);
  EXPECT_EQ(s.camera[1].pose.distance, 2);
  EXPECT_TRUE(s.instruments[0].instrument.is<Grasper>());
  EXPECT_EQ(s.instruments[0].path[0].position_mm, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(s.instruments[0].path[1].position_mm);
}

TEST(Script, MayNameItsLight) {
  EXPECT_FALSE(script_from_json(kGood, "s.json").light);
  for (const DrawnLight light : {DrawnLight::baked, DrawnLight::world, DrawnLight::scope}) {
    Script script = script_from_json(kGood, "s.json");
    script.light = light;
    EXPECT_EQ(script_from_json(script_to_json(script), "s.json").light, light);
  }
  EXPECT_NE(refusal("\"frames\": 10", "\"light\": \"sun\", \"frames\": 10").find("/light"),
            std::string::npos);
}

TEST(Script, MayMoveVerticesInTheToolsPlace) {
  Script script = script_from_json(kGood, "s.json");
  EXPECT_TRUE(script.vertices_mm.empty());
  script.instruments.clear();
  script.vertices_mm = {{1, 2, 0.1}, {1e-3, -5, 7}};
  EXPECT_EQ(script_from_json(script_to_json(script), "s.json").vertices_mm, script.vertices_mm);
  const auto refused = [](const std::string& states) {
    return refusal("\"frames\": 10", "\"vertices_mm\": " + states + ", \"frames\": 10");
  };
  EXPECT_NE(refused("[[0, 0, 0]]").find("/instruments: must be empty"), std::string::npos);
  EXPECT_NE(refused("[]").find("/vertices_mm"), std::string::npos);
  EXPECT_NE(refused("[[0, \"a\"]]").find("/vertices_mm/0/1"), std::string::npos);
  EXPECT_NE(refused("[[0, 0, 0, 0]]").find("/vertices_mm/0: must hold"), std::string::npos);
  EXPECT_NE(refused("[[0, 0, 0], []]").find("/vertices_mm/1: must hold"), std::string::npos);
}

TEST(Script, HostileOnesAreRefusedByKey) {
  const auto names = [](const std::string& message, const char* key) {
    return message.find(key) != std::string::npos;
  };
  EXPECT_TRUE(names(refusal("\"frames\": 10", "\"frames\": 2147483648"), "/frames"));
  EXPECT_TRUE(names(refusal("\"frames\": 10", "\"frames\": 0"), "/frames"));
  EXPECT_TRUE(names(refusal("0.02", "0"), "/time_step_s"));
  EXPECT_TRUE(names(refusal("0.02", "1e999"), "s.json"));
  EXPECT_TRUE(names(refusal("0.02", "null"), "/time_step_s"));
  EXPECT_TRUE(names(refusal("[64, 48]", "[64, 99999]"), "/size/1"));
  EXPECT_TRUE(names(refusal("\"frame\": 8", "\"frame\": 0"), "/camera/keyframes/1/frame"));
  EXPECT_TRUE(names(refusal("grab", "stab"), "/instruments/0/mode"));
  EXPECT_TRUE(names(refusal("\"time_s\": 1", "\"time_s\": 0"), "/instruments/0/path/1/time_s"));
  EXPECT_TRUE(names(refusal("[0, 1, 0]", "[0, 0, 0]"), "/direction"));
  EXPECT_TRUE(names(refusal("[1, 2, 3]", "[1, 2]"), "/position_mm"));
  EXPECT_TRUE(names(refusal("[1, 2, 3]", "[1e9, 2, 3]"), "/position_mm"));
  EXPECT_TRUE(names(refusal("\"depth_mm\": 5", "\"deep\": 5"), "depth_mm"));
  EXPECT_TRUE(names(refusal("[64, 48]", "[64, 48, 3]"), "/size"));
  EXPECT_TRUE(names(refusal("[64, 48]", "[64]"), "/size"));
  EXPECT_TRUE(names(refusal("[0, 1, 0]", "[1e300, 1e300, 0]"), "/path/1/direction: is (1e+300"));
  EXPECT_TRUE(names(refusal("[0, 1, 0]", "[1e-200, 0, 0]"), "/path/1/direction"));
  EXPECT_TRUE(names(refusal("\"radius_mm\": 4", "\"shaft\": [1, 0, 0], \"trocar_mm\": [9, 9, 9]"),
                    "/0/trocar_mm"));
  EXPECT_TRUE(names(refusal("\"radius_mm\": 4", "\"shaft\": [1e300, 0, 0]"), "/0/shaft"));
  EXPECT_TRUE(names(refusal("\"position_mm\"", "\"depth_mm\": 5, \"position_mm\""), "/path/0"));
  EXPECT_TRUE(names(refusal("\"depth_mm\": 5", "\"depth_mm\": 5, \"position_mm\": [1, 2, 3]"),
                    "/path/1/position_mm: stands beside"));
  // A mistyped key would be as if it were not there.
  EXPECT_TRUE(names(refusal("\"distance\": 2", "\"distnce\": 2"), "'distnce'"));
  EXPECT_TRUE(names(refusal("radius_mm", "radius_m"), "'radius_m'"));
  EXPECT_TRUE(names(refusal("\"size\"", "\"sise\""), "'sise'"));
  EXPECT_TRUE(names(refusal("interaction/1", "interaction/2"), "/schema"));
}

TEST(Script, DegreesAreRefusedByKey) {
  const std::string second = "s.json: /camera/keyframes/1/";
  EXPECT_TRUE(
      refusal("\"azimuth_rad\": 1", "\"azimuth_rad\": 90").starts_with(second + "azimuth_rad"));
  EXPECT_TRUE(refusal("0.5", "45").starts_with(second + "elevation_rad: is 45: angles are in rad"));
  EXPECT_TRUE(refusal("\"distance\": 2", "\"roll_rad\": 90").starts_with(second + "roll_rad"));
  EXPECT_TRUE(refusal("0, \"elevation_rad\": 0}", "90, \"elevation_rad\": 0}")
                  .starts_with("s.json: /camera/keyframes/0/azimuth_rad"));
  // Once round to each keyframe: the second ends a second turn.
  std::string twice = kGood;
  twice.replace(twice.find("\"azimuth_rad\": 0"), 16, "\"azimuth_rad\": 6.28");
  twice.replace(twice.find("\"azimuth_rad\": 1"), 16, "\"azimuth_rad\": 12.5");
  EXPECT_EQ(script_from_json(twice, "s.json").camera[1].pose.azimuth_rad, 12.5);
}

TEST(CameraAt, PassesThroughKeyframesWithoutAJerk) {
  Script s;
  s.camera = {{0, {0, 0, 1, 0}}, {10, {1, 0, 1, 0}}, {20, {0.5, 0.3, 2, 0}}};
  for (const CameraKeyframe& key : s.camera) {
    EXPECT_NEAR(camera_at(s, key.frame).azimuth_rad, key.pose.azimuth_rad, 1e-12);
    EXPECT_NEAR(camera_at(s, key.frame).distance, key.pose.distance, 1e-12);
  }
  EXPECT_EQ(camera_at(s, 99).azimuth_rad, 0.5);
  double last_step = 0;
  for (int frame = 1; frame <= 20; ++frame) {
    const double step = camera_at(s, frame).azimuth_rad - camera_at(s, frame - 1).azimuth_rad;
    if (frame > 1) {
      EXPECT_LT(std::abs(step - last_step), 0.05) << frame;  // 1 rad in 10 frames
    }
    last_step = step;
  }
}

std::string script_with(const std::string& camera, const std::string& more = "") {
  return R"({"schema": "organbake/interaction/1", "name": "free", "time_step_s": 0.02,
             "frames": 3, "instruments": [], "size": [320, 240],)" +
         more + R"("camera": )" + camera + "}";
}

constexpr const char* kLooking = R"({"keyframes": [
  {"frame": 0, "position_mm": [0, -300, 0], "look_at_mm": [0, 0, 0]},
  {"frame": 2, "position_mm": [300, 0, 0], "look_at_mm": [0, 0, 0], "up_direction": [0, 0, 2]}]})";

View view_of_frame(const Script& script, int frame) {
  return view_at(script, frame, organ_to_play().cameras, script.width, script.height);
}

TEST(ScriptCamera, LooksFromAPlaceAtAPlace) {
  const Script script = script_from_json(script_with(kLooking), "s.json");
  const View first = view_of_frame(script, 0), last = view_of_frame(script, 2);
  EXPECT_LT((first.camera.center_world_mm() - Eigen::Vector3d(0, -300, 0)).norm(), 1e-9);
  EXPECT_LT((last.camera.center_world_mm() - Eigen::Vector3d(300, 0, 0)).norm(), 1e-9);
  EXPECT_LT((last.camera.view_direction_world() + Eigen::Vector3d::UnitX()).norm(), 1e-9);
  // Half-way the eye has turned half of the right angle.
  const View middle = view_of_frame(script, 1);
  EXPECT_NEAR(middle.camera.view_direction_world().dot(first.camera.view_direction_world()),
              std::sqrt(0.5), 1e-9);
}

TEST(ScriptCamera, TakesPosesAndIntrinsicsAsTheyAre) {
  const std::string camera = R"({"intrinsics": {"fx": 400, "fy": 410, "cx": 150, "cy": 125},
    "keyframes": [{"frame": 0, "camera_from_world":
      {"rotation": [[1, 0, 0], [0, 0, -1], [0, 1, 0]], "translation_mm": [1, 2, 300]}}]})";
  const Script script = script_from_json(script_with(camera), "s.json");
  const View view = view_of_frame(script, 1);
  EXPECT_EQ(view.camera.intrinsics.fy, 410);
  EXPECT_EQ(view.camera.camera_from_world.translation, Eigen::Vector3d(1, 2, 300));
  // In a picture of twice the width its pixels are half as wide.
  const View wide = view_at(script, 1, organ_to_play().cameras, 640, 240);
  EXPECT_EQ(wide.camera.intrinsics.fx, 800);
  EXPECT_EQ(wide.camera.intrinsics.cx, 300);
  EXPECT_EQ(wide.camera.intrinsics.cy, 125);
  const Script again = script_from_json(script_to_json(script), "again.json");
  EXPECT_EQ(view_of_frame(again, 0), view);
}

TEST(ScriptCamera, PlaysARecordedSequence) {
  const TemporaryFolder folder;
  CameraSet set;
  for (int i = 0; i < 3; ++i) {
    PosedCamera camera = organ_to_play().cameras.cameras[i];
    camera.intrinsics.cx += i;
    set.cameras.push_back(camera);
  }
  write_file_atomically(folder.path() / "seq.json", cameras_to_json(set));
  write_file_atomically(folder.path() / "s.json", script_with(R"({"recorded": "seq.json"})"));
  const Script script = read_script(folder.path() / "s.json");
  for (int i = 0; i < 3; ++i) {
    const View view = view_at(script, i, organ_to_play().cameras, 128, 128);
    EXPECT_EQ(view.camera.intrinsics.cx, set.cameras[i].intrinsics.cx);
    EXPECT_EQ(view.camera.camera_from_world.translation,
              set.cameras[i].camera_from_world.translation);
  }
  set.cameras.pop_back();
  write_file_atomically(folder.path() / "seq.json", cameras_to_json(set));
  EXPECT_THROW(read_script(folder.path() / "s.json"), UsageError);  // two cameras, three frames
  set.cameras = {organ_to_play().cameras.cameras[0]};
  set.cameras.resize(3, set.cameras[0]);
  set.cameras[1].intrinsics.k1 = 0.1;
  Script own = script;
  EXPECT_THROW(take_recorded(set, "seq.json", own), UsageError);
}

TEST(ScriptCamera, NamesWhatIsWrong) {
  const auto refusal = [](const std::string& camera) -> std::string {
    return message_of(ExitCode::bad_data, [&] { script_from_json(script_with(camera), "s.json"); });
  };
  EXPECT_NE(refusal(R"({"keyframes": [{"frame": 0, "position_mm": [0, 0, 1]}]})")
                .find("/camera/keyframes/0"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"keyframes": [{"frame": 0, "position_mm": [0, 0, 1],
                        "look_at_mm": [0, 0, 1]}]})")
                .find("is where the eye is"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0},
                        {"frame": 1, "position_mm": [0, 0, 1], "look_at_mm": [0, 0, 0]}]})")
                .find("mixes"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"keyframes": [{"frame": 0, "camera_from_world":
                        {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]],
                         "translation_mm": [0, 0, 0]}}]})")
                .find("proper rotation"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"recorded": "a.json", "keyframes": []})").find("keyframes"),
            std::string::npos);
}

// The base layer's lattice has steps of 3 mm on a body with radii of 45–60 mm: its chords lie up to
// 3²/(8·45) mm below the formula's surface, lumps add as much again.
constexpr double kLatticeMm = 0.3;

TEST(SkinPoint, LiesOnTheOrgan) {
  const SyntheticOrgan& organ = organ_options().organ;
  for (const Eigen::Vector3d& d :
       {Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(-1, 0.2, -0.7)}) {
    const Eigen::Vector3d unit = d.normalized();
    const Eigen::Vector3d skin = skin_place(organ_to_play(), d).skin_mm;
    EXPECT_LT(((skin - organ.center).normalized() - unit).norm(), 1e-9);
    EXPECT_NEAR((skin - organ.center).norm(), organ.radius(unit), kLatticeMm);
  }
}

TEST(InstrumentMotion, PutsTheTipsSurfaceAtTheDepth) {
  Script script;
  const Eigen::Vector3d front(0, -1, 0);
  script.instruments = {
      {"p", {.radius_mm = 6}, {{1, std::nullopt, front, 4}, {2, std::nullopt, front, 8}}}};
  const InstrumentMotion motion(script, organ_to_play());
  EXPECT_FALSE(motion.at(0.9)[0].active);
  EXPECT_FALSE(motion.at(2.1)[0].active);
  const Instrument tip = motion.at(1.5)[0];
  ASSERT_TRUE(tip.active);
  const Eigen::Vector3d skin = skin_place(organ_to_play(), front).skin_mm;
  EXPECT_NEAR((tip.position_mm - skin).dot(front), 6 - 6,
              1e-9);  // centre: radius − depth above skin
}

TEST(InstrumentMotion, NamesTheDirectionThatMeetsNoSkin) {
  Bundle beside = organ_to_play();
  beside.cameras.manifold.center_world_mm.x() += 1000;
  Script script;
  script.name = "away";
  const Eigen::Vector3d at(1, 2, 3), away(1, 0, 0);
  script.instruments = {{"p", {.radius_mm = 6}, {{0, at}}},
                        {"q", {.radius_mm = 6}, {{0, at}, {1, {}, away, 4}}}};
  try {
    InstrumentMotion motion(script, beside);
    FAIL() << "accepted";
  } catch (const BadDataError& error) {
    EXPECT_EQ(std::string(error.what()).find("script 'away': /instruments/1/path/1/direction: no"),
              0u)
        << error.what();
  }
}

TEST(InstrumentMotion, TakesTheBundlesToolWhenTheScriptNamesNoSize) {
  Script script;
  script.instruments = {{"p", {.radius_mm = 0}, {{0, Eigen::Vector3d(1, 2, 3)}}}};
  const InstrumentMotion motion(script, organ_to_play());
  EXPECT_EQ(motion.at(0)[0].radius_mm, organ_to_play().mechanics.instrument_radius_mm);
}

}  // namespace
}  // namespace organbake
