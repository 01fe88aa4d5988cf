// SPDX-License-Identifier: GPL-3.0-or-later
// One lens as the programs of the field write it: from every file the same numbers.

#include "organbake/formats/lens_files.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/formats/camera_files.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using namespace std::string_literals;

constexpr int kLensWidth_px = 640, kLensHeight_px = 480;
const char* const kYaml =
    "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n"
    "   rows: 3\n   cols: 3\n   dt: d\n   data: [ 500., 0., 320., 0., 510., 240., 0., 0., 1. ]\n"
    "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n"
    "   data: [ -0.3, 0.1, 0.001, -0.002, 0.01 ]\n";

class LensFile : public testing::Test {
 protected:
  Intrinsics read(const std::string& text, const std::string& name = "lens.yml") {
    write_file_atomically(folder_.path() / name, text);
    return read_intrinsics(folder_.path() / name, "frame.png", kLensWidth_px, kLensHeight_px);
  }
  std::string refusal(const std::string& text, const std::string& name = "lens.yml") {
    return message_of(ExitCode::bad_data, [&] { read(text, name); });
  }
  TemporaryFolder folder_;
};

void expect_the_lens(const Intrinsics& lens) {
  EXPECT_EQ(lens.width, kLensWidth_px);
  EXPECT_EQ(lens.height, kLensHeight_px);
  EXPECT_EQ(lens.fx, 500);
  EXPECT_EQ(lens.fy, 510);
  EXPECT_EQ(lens.cx, 320.5);  // from the first pixel's corner
  EXPECT_EQ(lens.cy, 240.5);
  EXPECT_EQ(lens.k1, -0.3);
  EXPECT_EQ(lens.k2, 0.1);
  EXPECT_EQ(lens.p1, 0.001);
  EXPECT_EQ(lens.p2, -0.002);
  EXPECT_EQ(lens.k3, 0.01);
}

TEST_F(LensFile, OpenCvsYamlAndItsOtherNames) {
  expect_the_lens(read(kYaml));
  expect_the_lens(
      read("K: [[500, 0, 320], [0, 510, 240], [0, 0, 1]]\n"
           "D: [-0.3, 0.1, 0.001, -0.002, 0.01, 0, 0, 0]\nimage_size: [640, 480]\n"));
  // ROS's camera_info.
  expect_the_lens(
      read("image_width: 640\nimage_height: 480\ncamera_name: scope\ncamera_matrix:\n  rows: 3\n"
           "  cols: 3\n  data: [500, 0, 320, 0, 510, 240, 0, 0, 1]\ndistortion_model: plumb_bob\n"
           "distortion_coefficients:\n  rows: 1\n  cols: 5\n"
           "  data: [-0.3, 0.1, 0.001, -0.002, 0.01]\n"));
}

TEST_F(LensFile, OpenCvsXmlAsItsOwnProgramWritesIt) {
  const std::string lens =
      "<image_width>640</image_width>\n<image_height>480</image_height>\n<flags>0</flags>\n"
      "<fisheye_model>0</fisheye_model>\n<camera_matrix type_id=\"opencv-matrix\">\n  <rows>3"
      "</rows>\n  <cols>3</cols>\n  <dt>d</dt>\n  <data>\n    5.0e+02 0. 320. 0. 510. 240. 0. 0. "
      "1.</data></camera_matrix>\n<distortion_coefficients type_id=\"opencv-matrix\">\n  <rows>5"
      "</rows>\n  <cols>1</cols>\n  <dt>d</dt>\n  <data>-0.3 0.1 0.001 -2.0e-03 "
      "0.01</data></distortion_coefficients>\n";
  const std::string whole = "<?xml version=\"1.0\"?>\n<opencv_storage>\n" + lens +
                            "<image_points type_id=\"opencv-matrix\"><rows>1</rows><cols>500"
                            "</cols><dt>\"2f\"</dt><data>1. 2.</data></image_points>\n"
                            "</opencv_storage>\n";
  expect_the_lens(read(whole, "out_camera_data.xml"));
  EXPECT_THAT(refusal(whole.substr(0, 300), "cut.xml"), HasSubstr("is no sound XML: line"));
  EXPECT_THAT(refusal("<opencv_storage><a>1</a></opencv_storage>", "other.xml"),
              HasSubstr("holds neither the 3×3 matrix 'camera_matrix'"));
}

TEST_F(LensFile, OpenCvsJson) {
  expect_the_lens(read(R"({"image_width": 640, "image_height": 480, "camera_matrix": {"type_id":
           "opencv-matrix", "rows": 3, "cols": 3, "dt": "d",
           "data": [500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0]},
           "dist_coeffs": [[-0.3, 0.1, 0.001, -0.002, 0.01]]})",
                       "lens.json"));
}

TEST_F(LensFile, WithoutASizeThePhotographsIsTaken) {
  const Intrinsics lens = read("K: [500, 0, 320, 0, 510, 240, 0, 0, 1]\n");
  EXPECT_EQ(lens.width, kLensWidth_px);
  EXPECT_EQ(lens.height, kLensHeight_px);
  EXPECT_FALSE(lens.has_distortion());
}

const char* const kMatrix = "K: [500, 0, 320, 0, 510, 240, 0, 0, 1]\n";

void expect_the_fisheye(const Intrinsics& lens) {
  EXPECT_EQ(lens.model, LensModel::fisheye);
  EXPECT_EQ(lens.fx, 500);
  EXPECT_EQ(lens.cx, 320.5);
  EXPECT_EQ(lens.k1, -0.03);
  EXPECT_EQ(lens.k2, 0.01);
  EXPECT_EQ(lens.k3, 0.001);
  EXPECT_EQ(lens.k4, -0.002);
  EXPECT_EQ(lens.p1, 0);
}

// Four numbers of a fisheye look like k1 k2 p1 p2: read as these they would bend the picture.
TEST_F(LensFile, FisheyesAsEachProgramNamesThem) {
  const std::string k = std::string(kMatrix) + "D: [-0.03, 0.01, 0.001, -0.002]\n";
  for (const char* model : {"distortion_model: equidistant\n", "distortion_model: fisheye\n",
                            "camera_model: kannala_brandt\n", "fisheye_model: 1\n"})
    expect_the_fisheye(read(k + model));
  // Kalibr.
  expect_the_fisheye(
      read("cam0:\n  camera_model: pinhole\n  intrinsics: [500, 510, 320, 240]\n"
           "  distortion_model: equidistant\n  distortion_coeffs: [-0.03, 0.01, 0.001, -0.002]\n"
           "  resolution: [640, 480]\n  rostopic: /cam0\n"));
  const std::string frames = R"("frames": [{"file_path": "frame.png",
      "transform_matrix": [[1,0,0,3],[0,1,0,2],[0,0,1,9],[0,0,0,1]]}]})";
  const std::string keys = R"({"w": 640, "h": 480, "fl_x": 500, "fl_y": 510, "cx": 320.5, "cy":
      240.5, "k1": -0.03, "k2": 0.01, "k3": 0.001, "k4": -0.002, )";
  expect_the_fisheye(read(keys + R"("camera_model": "OPENCV_FISHEYE", )" + frames, "t.json"));
  expect_the_fisheye(read(keys + R"("is_fisheye": true, )" + frames, "t.json"));
  expect_the_fisheye(read(R"({"width": 640, "height": 480, "fx": 500, "fy": 510, "cx": 320.5,
      "cy": 240.5, "fisheye_k1_k2_k3_k4": [-0.03, 0.01, 0.001, -0.002]})",
                          "ours.json"));
  EXPECT_THAT(refusal(std::string(kMatrix) + "D: [0.1, 0, 0, 0, 0]\nfisheye_model: 1\n"),
              HasSubstr("has 5 numbers; a fisheye's has four"));
  EXPECT_THAT(refusal(std::string(kMatrix) + "fisheye_model: 1\n"), HasSubstr("lacks its k1"));
}

TEST_F(LensFile, OtherModelsOfLensesAreRefusedByName) {
  const std::string k = std::string(kMatrix) + "D: [-0.3, 0.1, 0.001, -0.002]\n";
  EXPECT_THAT(refusal(k + "camera_model: omni\n"), HasSubstr("\"omni\""));
  EXPECT_THAT(refusal(k + "distortion_model: fov\n"), HasSubstr("\"fov\""));
  // ROS's rational model.
  EXPECT_THAT(refusal(std::string(kMatrix) + "distortion_model: rational_polynomial\n"
                                             "D: [0.1, 0, 0, 0, 0, 0.1, 0, 0]\n"),
              HasSubstr("no rational model"));
  const auto transforms = [](const std::string& more) {
    return R"({"w": 640, "h": 480, "fl_x": 500, )" + more +
           R"("frames": [{"file_path": "frame.png",
             "transform_matrix": [[1,0,0,3],[0,1,0,2],[0,0,1,9],[0,0,0,1]]}]})";
  };
  EXPECT_EQ(read(transforms(R"("camera_model": "OPENCV", "k1": 0.1, )"), "t.json").k1, 0.1);
  EXPECT_THAT(refusal(transforms(R"("camera_model": "EQUIRECTANGULAR", "k1": 0.1, )"), "t.json"),
              HasSubstr("\"EQUIRECTANGULAR\""));
  EXPECT_THAT(refusal(transforms(R"("k4": 0.2, )"), "t.json"), HasSubstr("k4"));
  EXPECT_THAT(refusal(R"({"fl_x": 500, "frames": 4})", "t.json"), HasSubstr("no list of cameras"));
  EXPECT_THAT(refusal(transforms(R"("k1": "0.2", )"), "t.json"), HasSubstr("'k1' is no number"));
  EXPECT_THAT(refusal(transforms(R"("k1": null, )"), "t.json"), HasSubstr("'k1' is no number"));
}

// Dropped without a word it would bend what is measured.
TEST_F(LensFile, DistortionThatCannotBeReadIsRefused) {
  const std::string header = "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: ";
  const auto yaml = [&](const std::string& columns, const std::string& data) {
    return "%YAML:1.0\n---\n" + std::string(kMatrix) + header + columns +
           "\n   dt: d\n   data: [ " + data + " ]\n";
  };
  EXPECT_EQ(read(yaml("5", "-0.3, .12, .001, -.002, .05")).k3, 0.05);
  EXPECT_THAT(refusal(yaml("4", "-0.3, .12, .001, -.002, .05")),
              HasSubstr("says 1 rows and 4 columns, and holds 5 numbers"));
  EXPECT_THAT(refusal(yaml("5", "-0.3, .Nan, .001, -.002, .05")), HasSubstr("'.Nan'"));
  EXPECT_THAT(refusal(yaml("5", "-0.3, .nan, .001, -.002, .05")), HasSubstr("not finite"));
  EXPECT_THAT(refusal(yaml("5", "-0.3, .inf, .001, -.002, .05")), HasSubstr("not finite"));
  EXPECT_THAT(refusal(yaml("3", "-0.3, .12, .001")), HasSubstr("has 3 numbers; OpenCV's have 4"));
  EXPECT_FALSE(read(yaml("3", "0, 0, 0")).has_distortion());
  const auto lists = [](const std::string& d) { return kMatrix + d; };
  EXPECT_THAT(refusal(lists("D: [-0.3, none, 0, 0]\n")), HasSubstr("'none', which is no number"));
  EXPECT_THAT(refusal(lists("D: [[-0.3, 0.1], [0.1]]\n")), HasSubstr("its 'D'"));
  EXPECT_THAT(refusal(lists("dist_params: [-0.3, 0.1, 0, 0]\n")), HasSubstr("'distparams'"));
  EXPECT_EQ(read(lists("distortion_coeffs: [-0.3, 0.1, 0, 0]\n")).k1, -0.3);
  const auto xml = [](const std::string& columns, const std::string& data) {
    return "<opencv_storage><K type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><data>500 0 "
           "320 0 510 240 0 0 1</data></K><D type_id=\"opencv-matrix\"><rows>1</rows><cols>" +
           columns + "</cols><data>" + data + "</data></D></opencv_storage>";
  };
  EXPECT_EQ(read(xml("5", "-0.3 0.1 0 0 0.2"), "l.xml").k3, 0.2);
  EXPECT_THAT(refusal(xml("4", "-0.3 0.1 0 0 0.2"), "l.xml"), HasSubstr("4 columns"));
  EXPECT_THAT(refusal(xml("5", "-0.3 .Nan 0 0 0.2"), "l.xml"), HasSubstr("its 'd'"));
  EXPECT_THAT(refusal(xml("5", "-0.3 nan 0 0 0.2"), "l.xml"), HasSubstr("not finite"));
  EXPECT_THAT(refusal("K: [500, 0, 0, 0, 510, 0, 320, 240, 1]\n"), HasSubstr("transposed"));
  EXPECT_THAT(refusal("K: [500, 9, 320, 0, 510, 240, 0, 0, 1]\n"), HasSubstr("skew"));
}

TEST_F(LensFile, FilesOfOtherProgramsAreNamed) {
  EXPECT_THAT(refusal("PK\x03\x04\x14\0\0\0"s, "c.npz"), HasSubstr("NumPy archive"));
  EXPECT_THAT(refusal("\x93NUMPY\x01\0v"s, "c.npy"), HasSubstr("cv2.FileStorage"));
  EXPECT_THAT(refusal("MATLAB 5.0 MAT-file, Platform: GLNXA64"s, "c.mat"),
              HasSubstr("jsonencode(toStruct"));
  EXPECT_THAT(refusal("\x89HDF\r\n\x1a\n"s, "c.mat"), HasSubstr("MATLAB file"));
  EXPECT_THAT(refusal("#polynomial coefficients for the DIRECT mapping function (ocam_model.ss)\n"
                      "5 -380.1 0 0.0007 1e-7 0\n",
                      "calib_results.txt"),
              HasSubstr("OCamCalib"));
  EXPECT_THAT(refusal("K: \x01\0"s, "c.bin"), HasSubstr("is no text"));
}

// The first pixel's centre is (1, 1), the older matrix transposed.
TEST_F(LensFile, MatlabsStructuresAsItWritesThem) {
  const std::string distortion =
      R"("RadialDistortion": [-0.3, 0.1, 0.01], "TangentialDistortion": [0.001, -0.002])";
  for (const std::string& matrix : {R"("IntrinsicMatrix": [[500,0,0],[0,510,0],[321,241,1]])"s,
                                    R"("K": [[500,0,321],[0,510,241],[0,0,1]])"s,
                                    R"("FocalLength": [500, 510], "PrincipalPoint": [321, 241])"s})
    expect_the_lens(read(
        "{" + matrix + R"(, "ImageSize": [480, 640], "Skew": 0, )" + distortion + "}", "m.json"));
  EXPECT_THAT(
      refusal(R"({"K": [[500,0,321],[0,510,241],[0,0,1]], "RadialDistortion": [1]})", "m.json"),
      HasSubstr("two or three numbers"));
}

TEST_F(LensFile, TheLeftEyeOfStereoDatasets) {
  // SCARED's frame_data.json; StereoMIS.
  expect_the_lens(read(R"({"camera-pose": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]],
      "camera-calibration": {"KL": [[500,0,320],[0,510,240],[0,0,1]],
        "DL": [[-0.3, 0.1, 0.001, -0.002, 0.01]], "KR": [[1,0,0],[0,1,0],[0,0,1]], "DR": [[0]]},
      "timestamp": 1})",
                       "frame_data.json"));
  expect_the_lens(
      read("[StereoLeft]\nres_x=640\nres_y=480\nfc_x=500\nfc_y=510\ncc_x=320\n"
           "cc_y=240\nkc_0=-0.3\nkc_1=0.1\nkc_2=0.001\nkc_3=-0.002\nkc_4=0.01\n"
           "kc_5=0\nkc_6=0\nkc_7=0\n",
           "StereoCalibration.ini"));
  EXPECT_THAT(refusal("[StereoLeft]\nfc_x=500\nfc_y=oops\ncc_x=3\ncc_y=2\n", "s.ini"),
              HasSubstr("'fcy'"));
  EXPECT_THAT(refusal("[StereoLeft]\nfc_x=500\nfc_y=510\ncc_x=320\ncc_y=240\nkc_0=nan\n", "s.ini"),
              HasSubstr("not finite"));
}

TEST_F(LensFile, AnAngleOfViewAloneTakesThePicturesSize) {
  const Intrinsics lens = read(R"({"camera_angle_x": 1.2, "frames": [{"file_path": "./train/r_0",
      "transform_matrix": [[1,0,0,3],[0,1,0,2],[0,0,1,9],[0,0,0,1]]}]})",
                               "transforms.json");
  EXPECT_EQ(lens.width, kLensWidth_px);
  EXPECT_NEAR(lens.fx, 320 / std::tan(0.6), 1e-9);
  EXPECT_EQ(lens.cy, 240);
}

TEST(CheckLensOfPicture, RefusesSharesOfTheSidesAndOtherSizes) {
  const auto refusal = [](double f, double cx, double cy, int width = 640, int height = 480) {
    const Intrinsics lens{width, height, f, f, cx, cy};
    return message_of(ExitCode::bad_data, [&] {
      check_lens_of_picture(lens, kLensWidth_px, kLensHeight_px, "lens.yml");
    });
  };
  EXPECT_NO_THROW(check_lens_of_picture({640, 480, 500, 500, 300, 260}, 640, 480, "lens.yml"));
  EXPECT_THAT(refusal(0.95, 1, 1), HasSubstr("lens.yml: has a focal length of 0.95, 0.95 px"));
  EXPECT_THAT(refusal(250, 160, 120), HasSubstr("far off the middle"));   // halved
  EXPECT_THAT(refusal(1000, 640, 480), HasSubstr("far off the middle"));  // doubled
  EXPECT_THAT(refusal(250, 160, 120, 320, 240), HasSubstr("is of pictures of 320x240"));
}

}  // namespace
}  // namespace organbake
