// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/script_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "organ_to_play.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"

namespace organbake {
namespace {

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
    try {
      script_from_json(script_with(camera), "s.json");
    } catch (const BadDataError& error) {
      return error.what();
    }
    return "taken";
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

}  // namespace
}  // namespace organbake
