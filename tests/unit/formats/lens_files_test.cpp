// SPDX-License-Identifier: GPL-3.0-or-later
// One lens as the programs of the field write it: from every file the same numbers.
#include <gmock/gmock.h>

#include "core/files.h"
#include "core/temporary_folder.h"
#include "formats/camera_files.h"
#include "support/error_message.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

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

// Four numbers of a fisheye look like k1 k2 p1 p2: read as these they would bend the picture.
TEST_F(LensFile, OtherModelsOfLensesAreRefusedByName) {
  const std::string k = "K: [500, 0, 320, 0, 510, 240, 0, 0, 1]\nD: [-0.3, 0.1, 0.001, -0.002]\n";
  EXPECT_THAT(refusal(k + "distortion_model: equidistant\n"), HasSubstr("\"equidistant\""));
  EXPECT_THAT(refusal(k + "camera_model: kannala_brandt\n"), HasSubstr("\"kannalabrandt\""));
  EXPECT_THAT(refusal(k + "fisheye_model: 1\n"), HasSubstr("\"fisheye\""));
  EXPECT_THAT(refusal("K: [500, 0, 320, 0, 510, 240, 0, 0, 1]\nD: [0, 0, 0, 0, 0, 0.1]\n"),
              HasSubstr("only k1 k2 p1 p2 k3"));
  const auto transforms = [](const std::string& more) {
    return R"({"w": 640, "h": 480, "fl_x": 500, )" + more +
           R"("frames": [{"file_path": "frame.png",
             "transform_matrix": [[1,0,0,3],[0,1,0,2],[0,0,1,9],[0,0,0,1]]}]})";
  };
  EXPECT_EQ(read(transforms(R"("camera_model": "OPENCV", "k1": 0.1, )"), "t.json").k1, 0.1);
  EXPECT_THAT(refusal(transforms(R"("camera_model": "OPENCV_FISHEYE", "k1": 0.1, )"), "t.json"),
              HasSubstr("\"OPENCV_FISHEYE\""));
  EXPECT_THAT(refusal(transforms(R"("is_fisheye": true, )"), "t.json"), HasSubstr("a fisheye"));
  EXPECT_THAT(refusal(transforms(R"("k4": 0.2, )"), "t.json"), HasSubstr("k4"));
}

}  // namespace
}  // namespace organbake
