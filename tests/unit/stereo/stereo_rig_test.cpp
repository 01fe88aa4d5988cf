// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/stereo/stereo_depth.h"

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/geometry/camera.h"
#include "organbake/phantom/laparoscopy.h"
#include "stereo_scene.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const EyePictures kPictures{.width = 720, .height = 576};
const char* const kHeader = "%YAML:1.0\n---\n";

std::string matrix(const std::string& name, int rows, int columns, const std::string& values) {
  return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
         "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data: [ " + values + " ]\n";
}

std::string lenses(const std::string& k1, const std::string& d1, const std::string& k2,
                   const std::string& d2) {
  return matrix(k1, 3, 3, "500., 0., 360., 0., 501., 288., 0., 0., 1.") +
         matrix(d1, 1, 5, "-0.1, 0.02, 0., 0., 0.") +
         matrix(k2, 3, 3, "502., 0., 350., 0., 503., 280., 0., 0., 1.") +
         matrix(d2, 1, 5, "-0.2, 0., 0., 0., 0.");
}

const std::string kPose =
    matrix("R", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.") + matrix("T", 3, 1, "-4.5, 0.1, 0.");

class StereoRigFile : public testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& text) {
    const fs::path path = folder_.path() / name;
    fs::create_directories(path.parent_path());
    write_file_atomically(path, text);
    return path;
  }
  StereoRig read(const std::string& text, EyePictures pictures = kPictures) {
    return read_stereo_rig(write("rig.yml", text), pictures);
  }
  std::string refusal(const std::string& text, EyePictures pictures = kPictures) {
    return message_of(ExitCode::bad_data, [&] { read(text, pictures); });
  }
  TemporaryFolder folder_;
};

void expect_the_rig(const StereoRig& rig) {
  EXPECT_EQ(rig.left.width, 720);
  EXPECT_EQ(rig.left.fx, 500);
  EXPECT_EQ(rig.left.cx, 360.5);  // from the first pixel's corner
  EXPECT_EQ(rig.right.fy, 503);
  EXPECT_EQ(rig.right.cy, 280.5);
  EXPECT_EQ(rig.right.k1, -0.2);
  EXPECT_NEAR(rig.right_from_left.translation.x(), -4.5, 1e-12);
}

TEST_F(StereoRigFile, OpenCvsMatricesUnderTheirUsualNames) {
  expect_the_rig(read(kHeader + lenses("K1", "D1", "K2", "D2") + kPose));
  expect_the_rig(read(kHeader + lenses("M1", "D1", "M2", "D2") + kPose));
  expect_the_rig(read(
      kHeader + lenses("cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2") + kPose));
  expect_the_rig(read(kHeader +
                      lenses("camera_matrix_1", "distortion_coefficients_1", "camera_matrix_2",
                             "distortion_coefficients_2") +
                      kPose));
  // Lists in place of OpenCV's matrices, as other programs dump them.
  expect_the_rig(
      read("K1: [[500, 0, 360], [0, 501, 288], [0, 0, 1]]\n"
           "K2: [[502, 0, 350], [0, 503, 280], [0, 0, 1]]\n"
           "D2: [-0.2, 0, 0, 0, 0]\nR: [0, 0, 0]\nT: [-4.5, 0.1, 0]\n"));
}

TEST_F(StereoRigFile, TwoFilesOfOneFolder) {
  write("cal/intrinsics.yml", kHeader + lenses("M1", "D1", "M2", "D2"));
  write("cal/extrinsics.yml", kHeader + kPose);
  expect_the_rig(read_stereo_rig(folder_.path() / "cal", kPictures));
}

TEST_F(StereoRigFile, RectifiedPicturesByTheirProjections) {
  const std::string p1 =
      matrix("P1", 3, 4, "500., 0., 360., 0., 0., 500., 288., 0., 0., 0., 1., 0.");
  const std::string p2 =
      matrix("P2", 3, 4, "500., 0., 340., -2250., 0., 500., 288., 0., 0., 0., 1., 0.");
  const std::string q = matrix("Q", 4, 4,
                               "1., 0., 0., -360., 0., 1., 0., -288., 0., 0., 0., 500., 0., 0., "
                               "0.22222222222222222, -4.4444444444444444");
  for (const std::string& text : {p1 + p2 + q, p1 + p2, q}) {
    const StereoRig rig = read(kHeader + text);
    EXPECT_NEAR(rig.left.fx, 500, 1e-9);
    EXPECT_NEAR(rig.left.cx, 360.5, 1e-9);
    EXPECT_NEAR(rig.right.cx, 340.5, 1e-9);
    EXPECT_NEAR(rig.right_from_left.translation.x(), -4.5, 1e-9);
    EXPECT_FALSE(rig.left.has_distortion());
  }
  // OpenCV's JSON.
  const StereoRig json = read(
      R"({"P1": {"type_id": "opencv-matrix", "rows": 3, "cols": 4, "dt": "d", "data": [500.0, 0, 360, 0, 0, 500, 288, 0, 0, 0, 1, 0]},
          "P2": {"type_id": "opencv-matrix", "rows": 3, "cols": 4, "dt": "d", "data": [500, 0, 340, -2250, 0, 500, 288, 0, 0, 0, 1, 0]}})");
  EXPECT_NEAR(json.baseline_mm(), 4.5, 1e-9);
}

TEST_F(StereoRigFile, TwoCamerasOfOurs) {
  CameraSet set;
  set.cameras.resize(2);
  for (PosedCamera& camera : set.cameras)
    camera.intrinsics = {.width = 720, .height = 576, .fx = 500, .fy = 500, .cx = 360, .cy = 288};
  set.cameras[0].name = "left";
  set.cameras[1].name = "right";
  set.cameras[0].camera_from_world.translation = {1, 2, 3};
  set.cameras[1].camera_from_world.translation = {-3.5, 2, 3};
  const StereoRig rig = read_stereo_rig(write("cameras.json", cameras_to_json(set)), kPictures);
  EXPECT_NEAR(rig.right_from_left.translation.x(), -4.5, 1e-12);
  EXPECT_EQ(rig.left.cx, 360);
  set.cameras.pop_back();
  const fs::path one = write("one.json", cameras_to_json(set));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_stereo_rig(one, kPictures); }),
              HasSubstr("holds 1 camera"));
}

TEST_F(StereoRigFile, AsKalibrStereoMisMatlabAndScaredWriteIt) {
  // Kalibr's lengths are metres.
  expect_the_rig(read(
      "cam0: {camera_model: pinhole, intrinsics: [500, 501, 360, 288], distortion_model: radtan,\n"
      "  distortion_coeffs: [-0.1, 0.02, 0, 0], resolution: [720, 576]}\n"
      "cam1:\n  T_cn_cnm1:\n  - [1, 0, 0, -0.0045]\n  - [0, 1, 0, 0.0001]\n  - [0, 0, 1, 0]\n"
      "  - [0, 0, 0, 1]\n  camera_model: pinhole\n  intrinsics: [502, 503, 350, 280]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [-0.2, 0, 0, 0]\n  resolution: [720, "
      "576]\n"));
  expect_the_rig(read(
      "[StereoLeft]\nres_x = 720\nres_y = 576\nfc_x=500\nfc_y=501\ncc_x=360\ncc_y=288\nkc_0=-0.1\n"
      "kc_1=0.02\nkc_2=0\nkc_3=0\nkc_4=0\n\n[StereoRight]\nres_x=720\nres_y=576\nfc_x=502\n"
      "fc_y=503\ncc_x=350\ncc_y=280\nkc_0=-0.2\nkc_1=0\nkc_2=0\nkc_3=0\nkc_4=0\nR_0=1\nR_1=0\n"
      "R_2=0\nR_3=0\nR_4=1\nR_5=0\nR_6=0\nR_7=0\nR_8=1\nT_0=-4.5\nT_1=0.1\nT_2=0\n"));
  expect_the_rig(read(R"({"CameraParameters1": {"ImageSize": [576, 720],
      "IntrinsicMatrix": [[500,0,0],[0,501,0],[361,289,1]], "RadialDistortion": [-0.1, 0.02],
      "TangentialDistortion": [0, 0]}, "CameraParameters2": {"ImageSize": [576, 720],
      "IntrinsicMatrix": [[502,0,0],[0,503,0],[351,281,1]], "RadialDistortion": [-0.2, 0],
      "TangentialDistortion": [0, 0]}, "RotationOfCamera2": [[1,0,0],[0,1,0],[0,0,1]],
      "TranslationOfCamera2": [-4.5, 0.1, 0]})"));
  expect_the_rig(read(R"({"camera-pose": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]],
      "camera-calibration": {"KL": [[500,0,360],[0,501,288],[0,0,1]], "DL": [[-0.1,0.02,0,0,0]],
      "KR": [[502,0,350],[0,503,280],[0,0,1]], "DR": [[-0.2,0,0,0,0]],
      "R": [[1,0,0],[0,1,0],[0,0,1]], "T": [[-4.5],[0.1],[0]]}})"));
  EXPECT_THAT(refusal("cam0: {intrinsics: [500, 501, 360, 288], distortion_model: radtan,\n"
                      "  distortion_coeffs: [0, 0, 0, 0], resolution: [720, 576]}\n"),
              HasSubstr("is of one camera"));
}

TEST_F(StereoRigFile, ADistortionThatCannotBeReadIsRefused) {
  const std::string right = matrix("K2", 3, 3, "502., 0., 350., 0., 503., 280., 0., 0., 1.") +
                            matrix("D2", 1, 5, "-0.2, 0., 0., 0., 0.") + kPose;
  const std::string left = matrix("K1", 3, 3, "500., 0., 360., 0., 501., 288., 0., 0., 1.");
  EXPECT_THAT(refusal(kHeader + left + matrix("D1", 1, 4, "-.3, .12, .001, -.002, .05") + right),
              HasSubstr("its 'D1' says 1 rows and 4 columns, and holds 5 numbers"));
  EXPECT_THAT(refusal(kHeader + left + matrix("D1", 1, 5, "-.3, .Nan, .001, -.002, .05") + right),
              HasSubstr("its 'D1' holds '.Nan'"));
}

TEST_F(StereoRigFile, FolderOfTextsWithRowsOfNumbers) {
  write("c/calib.left.intrinsics.txt", "500 0 360\n0 501 288\n0 0 1\n");
  write("c/calib.left.distortion.txt", "-0.1 0.02 0 0 0\n");
  write("c/calib.right.intrinsics.txt", "502 0 350\n0 503 280\n0 0 1\n");
  write("c/calib.right.distortion.txt", "-0.2 0 0 0 0");
  write("c/calib.l2r.txt", "1 0 0 \n0 1 0 \n0 0 1 \n-4.5 0.1 0 \n");
  expect_the_rig(read_stereo_rig(folder_.path() / "c", kPictures));
  write("c/calib.l2r.txt", "1 0 0 -4.5\n0 1 0 0.1\n0 0 1 0\n0 0 0 1\n");
  expect_the_rig(read_stereo_rig(folder_.path() / "c", kPictures));
  write("c/calib.l2r.txt", "1 0 0 oops\n");
  EXPECT_THAT(
      message_of(ExitCode::bad_data, [&] { read_stereo_rig(folder_.path() / "c", kPictures); }),
      HasSubstr("'oops' is no number"));
}

TEST_F(StereoRigFile, TextsAsHamlynsPhantomHasThem) {
  write("h/calib.left.intrinsic.txt", "500 0 360\n0 501 288\n0 0 1\n");
  write("h/calib.left.distortion.txt", "-0.1 0.02 0 0");
  write("h/calib.right.intrinsic.txt", "502 0 350\n0 503 280\n0 0 1\n");
  write("h/calib.right.distortion.txt", "-0.2 0 0 0");
  write("h/calib.l2r.4x4", "1 0 0 -4.5\n0 1 0 0.1\n0 0 1 0\n0 0 0 1\n");
  expect_the_rig(read_stereo_rig(folder_.path() / "h", kPictures));
  write("h/other.left.intrinsic.txt", "600 0 360\n0 601 288\n0 0 1\n");
  EXPECT_THAT(
      message_of(ExitCode::bad_data, [&] { read_stereo_rig(folder_.path() / "h", kPictures); }),
      HasSubstr("'calib.left.intrinsic.txt' and 'other.left.intrinsic.txt'"));
}

// One file of OpenCV's a matrix, which it names as the file; the pose is the left eye's from the
// right one's.
TEST_F(StereoRigFile, FilesOfOneMatrixEach) {
  const auto file = [&](const std::string& name, int rows, int columns, const std::string& data) {
    std::string key = "calib_" + name;
    std::replace(key.begin(), key.end(), '.', '_');
    write("s/calib." + name + ".xml", "<?xml version=\"1.0\"?>\n<opencv_storage>\n<" + key +
                                          " type_id=\"opencv-matrix\">\n"
                                          "  <rows>" +
                                          std::to_string(rows) + "</rows>\n  <cols>" +
                                          std::to_string(columns) +
                                          "</cols>\n  <dt>d</dt>\n  <data>" + data + "</data></" +
                                          key + ">\n</opencv_storage>\n");
  };
  file("left.intrinsic", 3, 3, "500. 0. 360. 0. 501. 288. 0. 0. 1.");
  file("left.distortion", 1, 4, "-0.1 0.02 0. 0.");
  file("right.intrinsic", 3, 3, "502. 0. 350. 0. 503. 280. 0. 0. 1.");
  file("right.distortion", 1, 4, "-0.2 0. 0. 0.");
  file("r2l.rotation", 3, 3, "1. 0. 0. 0. 1. 0. 0. 0. 1.");
  file("r2l.translation", 3, 1, "4.5 -0.1 0.");
  expect_the_rig(read_stereo_rig(folder_.path() / "s", kPictures));
  file("right.distortion", 1, 4, "-0.2 0. 0.");
  EXPECT_THAT(
      message_of(ExitCode::bad_data, [&] { read_stereo_rig(folder_.path() / "s", kPictures); }),
      HasSubstr("says 1 rows and 4 columns, and holds 3 numbers"));
}

TEST_F(StereoRigFile, UnitsOtherThanMillimetres) {
  EyePictures metres = kPictures;
  metres.mm_per_unit = 1000;
  const std::string text = kHeader + lenses("K1", "D1", "K2", "D2") +
                           matrix("R", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.") +
                           matrix("T", 3, 1, "-0.0045, 0.0001, 0.");
  expect_the_rig(read(text, metres));
  EXPECT_THAT(refusal(text), HasSubstr("--unit"));
}

TEST_F(StereoRigFile, WhatCannotBeMeantIsRefused) {
  const std::string eyes = kHeader + lenses("K1", "D1", "K2", "D2");
  const std::string r = matrix("R", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.");
  EXPECT_THAT(refusal(eyes + r + matrix("T", 3, 1, "0., 0., 0.")), HasSubstr("0 mm apart"));
  EXPECT_THAT(refusal(eyes + r + matrix("T", 3, 1, "4.5, 0., 0.")),
              HasSubstr("on the left of the first"));
  EXPECT_THAT(refusal(eyes + r + matrix("T", 3, 1, "0., -4.5, 0.")), HasSubstr("side by side"));
  EXPECT_THAT(refusal(eyes + r + matrix("T", 3, 1, ".nan, 0., 0.")), HasSubstr("NaN"));
  EXPECT_THAT(refusal(eyes), HasSubstr("how the eyes stand"));
  EXPECT_THAT(refusal(kHeader + kPose), HasSubstr("lacks the matrices"));
  EXPECT_THAT(refusal("just words"), HasSubstr("no named matrices"));
  EXPECT_THAT(refusal(eyes + kPose + "image_width: 1920\nimage_height: 1080\n"),
              HasSubstr("1920x1080"));
  // No size in the file, but the principal point tells.
  EXPECT_THAT(refusal(eyes + kPose, {.width = 1920, .height = 1080}), HasSubstr("another size"));
  EXPECT_THROW(read_stereo_rig(folder_.path() / "missing.yml", kPictures), NoInputError);
  fs::create_directory(folder_.path() / "empty");
  EXPECT_THROW(read_stereo_rig(folder_.path() / "empty", kPictures), BadDataError);
}

// Eyes that look inward and are turned against each other.
StereoRig askew_rig() {
  Intrinsics lens{.width = 480, .height = 384, .fx = 347, .fy = 348, .cx = 233, .cy = 193};
  StereoRig rig{lens, lens, {}};
  rig.right.cx = 248;
  rig.right.fx = 350;
  rig.left.k1 = -0.05;
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitZ()))
                                   .toRotationMatrix();
  rig.right_from_left = {turn, {-4.5, 0.1, 0.05}};
  return rig;
}

TEST(Rectifier, PicturesThatStandSideBySideStayAsTheyAre) {
  const LaparoscopyPhantom phantom(stereo_scene(96, 72));
  const Rectifier rectifier(rig_of(phantom));
  EXPECT_FALSE(rectifier.changes_pictures());
  EXPECT_NEAR(rectifier.eyes().baseline_mm, 4.5, 1e-9);
  EXPECT_EQ(rectifier.eyes().disparity_at_infinity, 0);
}

TEST(Rectifier, PointsLieOnOneRowAndTheirDisparityIsTheirDepth) {
  const StereoRig rig = askew_rig();
  const Rectifier rectifier(rig);
  ASSERT_TRUE(rectifier.changes_pictures());
  const RectifiedEyes& eyes = rectifier.eyes();
  const Eigen::Matrix3d turn = eyes.rectified_from_left.rotation;
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(0, 0, 60), Eigen::Vector3d(20, -15, 45), Eigen::Vector3d(-25, 18, 95)}) {
    const Eigen::Vector3d turned = turn * point;
    const Eigen::Vector2d a = project(eyes.camera, turned);
    const Eigen::Vector2d b = project(eyes.right(), turned);
    EXPECT_NEAR(a.y(), b.y(), 1e-9);
    const double disparity = a.x() - b.x() - eyes.disparity_at_infinity;
    EXPECT_NEAR(eyes.camera.fx * eyes.baseline_mm / disparity, turned.z(), 1e-6);
    // The same place of the right eye's camera as it was calibrated.
    const Eigen::Vector3d by_rig = rig.right_from_left * point;
    const Eigen::Vector3d by_eyes = eyes.right().camera_from_world * turned;
    EXPECT_NEAR(by_rig.norm(), by_eyes.norm(), 1e-6);
  }
}

// A rendered pair of turned cameras comes out as exact as one that stands straight.
void expect_the_scene(const StereoRig& rig) {
  LaparoscopyOptions scene = stereo_scene(480, 384);
  scene.round_view = false;
  const LaparoscopyPhantom phantom(scene);
  PosedCamera left = phantom.camera(0), right = left;
  left.intrinsics = rig.left;
  right.intrinsics = rig.right;
  right.camera_from_world = rig.right_from_left * left.camera_from_world;
  const Eigen::Vector3d light = left.center_world_mm();
  const LaparoscopyFrame a = phantom.frame_seen_by(left, light, 1),
                         b = phantom.frame_seen_by(right, light, 2);
  const Rectifier rectifier(rig);
  PreparedFrame prepared;
  const StereoDepth found = depth_of_pair(rectifier, a.image, b.image, &prepared);
  // The truth as the rectified camera sees it.
  PosedCamera turned{"turned", rectifier.eyes().camera,
                     rectifier.eyes().rectified_from_left * left.camera_from_world};
  const LaparoscopyFrame truth = phantom.frame_seen_by(turned, light, 3);
  const DepthErrors errors = errors_of(found.depth.depth, truth.depth_mm, prepared.tissue);
  EXPECT_LT(errors.mean, 0.01);
  EXPECT_LT(errors.bad, 0.03);
  EXPECT_GT(errors.dense, 0.8);
  EXPECT_LT(std::abs(found.rows_apart_px), 0.1);
}

TEST(Rectifier, TurnedEyesMeasureTheSameScene) {
  StereoRig rig = askew_rig();
  rig.left = pinhole_of(rig.left);
  expect_the_scene(rig);
}

TEST(Rectifier, FisheyesMeasureTheSameScene) {
  StereoRig rig = askew_rig();
  for (Intrinsics* lens : {&rig.left, &rig.right}) {
    *lens = pinhole_of(*lens);
    lens->model = LensModel::fisheye;
    lens->fx *= 0.85, lens->fy *= 0.85;  // 94° across
    lens->k1 = -0.02, lens->k2 = 0.004, lens->k3 = -0.001;
  }
  expect_the_scene(rig);
}

}  // namespace
}  // namespace organbake
