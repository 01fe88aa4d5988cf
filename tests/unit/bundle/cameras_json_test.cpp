// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/cameras_json.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(CamerasJson, RoundTripIsExact) {
  CameraSet set = small_bundle().cameras;
  set.cameras[1].intrinsics.k1 = -0.125;
  set.cameras[1].intrinsics.p2 = 1.0 / 3;
  set.images = {"a.png", "b.png"};
  const CameraSet back = cameras_from_json(cameras_to_json(set), "t");
  ASSERT_EQ(back.cameras.size(), 2u);
  for (int c = 0; c < 2; ++c) {
    EXPECT_EQ(back.cameras[c].camera_from_world.rotation,
              set.cameras[c].camera_from_world.rotation);
    EXPECT_EQ(back.cameras[c].camera_from_world.translation,
              set.cameras[c].camera_from_world.translation);
    EXPECT_EQ(back.cameras[c].intrinsics.fx, set.cameras[c].intrinsics.fx);
    EXPECT_EQ(back.cameras[c].intrinsics.p2, set.cameras[c].intrinsics.p2);
  }
  EXPECT_EQ(back.images, set.images);
  EXPECT_EQ(back.manifold.directions, set.manifold.directions);
}

TEST(CamerasJson, AFisheyeHasItsOwnKey) {
  CameraSet set = small_bundle().cameras;
  Intrinsics& lens = set.cameras[0].intrinsics;
  lens.model = LensModel::fisheye;
  lens.k1 = -0.1, lens.k2 = 0.02, lens.k3 = 1.0 / 3, lens.k4 = -0.004;
  const std::string text = cameras_to_json(set);
  const Intrinsics back = cameras_from_json(text, "t").cameras[0].intrinsics;
  EXPECT_EQ(back.model, LensModel::fisheye);
  EXPECT_EQ(back.k1, lens.k1);
  EXPECT_EQ(back.k3, lens.k3);
  EXPECT_EQ(back.k4, lens.k4);
  EXPECT_EQ(back.p1, 0);
  EXPECT_EQ(text.find("distortion"), std::string::npos);
  EXPECT_THROW(
      cameras_from_json(
          replaced(text, "\"fisheye_k1_k2_k3_k4\": [", "\"fisheye_k1_k2_k3_k4\": [0, "), "t"),
      BadDataError);
}

TEST(CamerasJson, RefusesAndNamesTheKey) {
  const std::string good = cameras_to_json(small_bundle().cameras);
  const auto message = [](const std::string& text) -> std::string {
    try {
      cameras_from_json(text, "c.json");
    } catch (const BadDataError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message(good), "accepted");
  EXPECT_NE(message(replaced(good, "\"fx\": 10.0", "\"fx\": -1")).find("/cameras/0/fx"),
            std::string::npos);
  EXPECT_NE(message(replaced(good, "\"width\": 8", "\"width\": 2147483648")).find("/width"),
            std::string::npos);
  EXPECT_NE(
      message(replaced(good, "\"width\": 8", "\"width\": 18446744073709551615")).find("/width"),
      std::string::npos);
  EXPECT_NE(message(replaced(good, "\"rotation\"", "\"rotten\"")).find("rotation"),
            std::string::npos);
  EXPECT_NE(message(replaced(good, "cameras/1", "cameras/9")).find("/schema"), std::string::npos);
  EXPECT_NE(message("{\"schema\": 3").find("line 1"), std::string::npos);
  EXPECT_NE(message("[]").find("must be an object"), std::string::npos);
}

TEST(CamerasJson, ARotationOfSixDigitsIsTakenAndMadeExact) {
  CameraSet set = small_bundle().cameras;
  Eigen::Matrix3d& r = set.cameras[0].camera_from_world.rotation;
  const Eigen::Matrix3d exact = r;
  r = (r * 1e6).array().round() / 1e6;
  const Eigen::Matrix3d read =
      cameras_from_json(cameras_to_json(set), "t").cameras[0].camera_from_world.rotation;
  EXPECT_LT((read - exact).norm(), 3e-6) << "half a digit in each entry";
  EXPECT_LT((read.transpose() * read - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  r *= 1.001;
  EXPECT_THROW(cameras_from_json(cameras_to_json(set), "t"), BadDataError);
}

TEST(CamerasJson, AMirroredRotationIsNoRotation) {
  CameraSet set = small_bundle().cameras;
  set.cameras[0].camera_from_world.rotation.row(0) *= -1;
  EXPECT_THROW(cameras_from_json(cameras_to_json(set), "t"), BadDataError);
}

}  // namespace
}  // namespace organbake
