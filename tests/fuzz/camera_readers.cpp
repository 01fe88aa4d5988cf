// SPDX-License-Identifier: GPL-3.0-or-later
// Cameras and calibrations.
#include "fuzz/readers.h"
#include "organbake/bundle/bundle_pack.h"
#include "organbake/formats/camera_files.h"
#include "organbake/stereo/stereo_rig.h"

namespace organbake {
namespace {

constexpr int kWidth = 64, kHeight = 48;

void read_posed(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path file = folder.file("cameras.json", bytes);
  read_camera_file(file);
  read_intrinsics(file, "b.png", kWidth, kHeight);
}

void read_lens(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_intrinsics(folder.file("lens.yml", bytes), "b.png", kWidth, kHeight);
}

const std::vector<std::string> kColmapFiles = {"cameras.txt", "images.txt", "cameras.bin",
                                               "images.bin",  "rigs.txt",   "frames.txt",
                                               "rigs.bin",    "frames.bin"};

void read_colmap(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_camera_file(folder.parts(kColmapFiles, bytes));
}

void read_rig(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_stereo_rig(folder.file("rig.yml", bytes), {.width = 720, .height = 576});
}

const std::vector<std::string> kRigTexts = {"c.left.intrinsics.txt", "c.left.distortion.txt",
                                            "c.right.intrinsics.txt", "c.right.distortion.txt",
                                            "c.l2r.txt"};

void read_rig_texts(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_stereo_rig(folder.parts(kRigTexts, bytes), {.width = 720, .height = 576});
}

CameraSet two_cameras() {
  CameraSet set;
  for (const double x : {0., 4.5}) {
    PosedCamera camera;
    camera.name = x > 0 ? "right" : "left";
    camera.intrinsics = {
        .width = kWidth, .height = kHeight, .fx = 50, .fy = 51, .cx = 32, .cy = 24};
    camera.intrinsics.k1 = x / 100;
    camera.camera_from_world.translation = {-x, 2, 300};
    set.cameras.push_back(camera);
  }
  set.images = {"a.png", "b.png"};
  return set;
}

Seeds posed_seeds() {
  CameraSet with_manifold = two_cameras();
  with_manifold.manifold.directions = {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()};
  with_manifold.images.clear();
  CameraSet three = with_manifold;
  three.cameras.push_back(three.cameras.front());
  three.manifold.directions.push_back(Eigen::Vector3d::UnitZ());
  three.manifold.triangles = {{0, 1, 2}};
  CameraSet one = two_cameras();
  one.cameras.pop_back();
  one.images.pop_back();
  return {cameras_to_json(two_cameras()), cameras_to_json(with_manifold), cameras_to_json(three),
          cameras_to_json(one), transforms_json(two_cameras())};
}

Seeds transforms_seeds() {
  return {transforms_json(two_cameras()),
          R"({"camera_angle_x": 0.9, "w": 64, "h": 48, "frames": [{"file_path": "b.png",
              "transform_matrix": [[1,0,0,3],[0,1,0,2],[0,0,1,9],[0,0,0,1]]}]})"};
}

Seeds lens_seeds() {
  return {
      "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n"
      "   rows: 3\n   cols: 3\n   dt: d\n   data: [ 100., 0., 31.5, 0., 100., 31.5, 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
      "   data: [ 0.1, 0., 0., 0., 0. ]\n",
      R"({"width": 64, "height": 48, "fx": 50, "fy": 50, "cx": 32, "cy": 24,
              "distortion_k1_k2_p1_p2_k3": [0.1, 0, 0, 0, 0]})",
      "K: {rows: 3, cols: 3, data: [100, 0, 31.5, 0, 100, 31.5, 0, 0, 1]}\n"
      "D: {data: [0.1, 0, 0, 0, 0, 0, 0, 0]}\n",
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>64</image_width>\n"
      "<model>\"plain\"</model>\n<Camera_Matrix type_id=\"opencv-matrix\">\n<rows>3</rows>\n"
      "<cols>3</cols>\n<dt>d</dt>\n<data>100 0 31.5 0 1e2 31.5 0 0 1</data></Camera_Matrix>\n"
      "<dist_coeffs>0.1 0. 0. 0. 0.</dist_coeffs>\n</opencv_storage>\n",
      cameras_to_json(two_cameras()),
      transforms_json(two_cameras())};
}

Seeds refused_lenses() {
  const std::string k = "K: [100, 0, 31.5, 0, 100, 31.5, 0, 0, 1]\n";
  return {k + "D: [0.1, 0, 0, 0, 0, 0, 0, 0.2]\n", k + "distortion_model: equidistant\n",
          k + "camera_model: omni\n", k + "fisheye_model: 1\n", "<opencv_storage/>"};
}

std::string little_endian(const auto&... numbers) {
  PackedWriter bytes;
  (bytes.add(numbers), ...);
  return text_of(bytes.bytes());
}

// One camera of a kind of lens and two images, as COLMAP's binary files have them.
std::string colmap_binary() {
  using U32 = std::uint32_t;
  using U64 = std::uint64_t;
  const std::string cameras = little_endian(U64{1}, U32{3}, std::int32_t{4}, U64{64}, U64{48}, 50.,
                                            51., 32., 24., 0.1, 0., 0., 0.);
  std::string images = little_endian(U64{2});
  for (const char* name : {"a.png", "b.png"})
    images += little_endian(U32{9}, 1., 0., 0., 0., 1., 2., 300., U32{3}) + name + '\0' +
              little_endian(U64{1}, 5., 6., U64{0});
  // A rig of that camera and of another sensor, and one frame.
  const std::string rigs = little_endian(U64{1}, U32{1}, U32{2}, std::int32_t{0}, U32{3},
                                         std::int32_t{1}, U32{4}, std::uint8_t{0});
  const std::string frames = little_endian(U64{1}, U32{1}, U32{1}, 1., 0., 0., 0., 1., 2., 300.,
                                           U32{1}, std::int32_t{0}, U32{3}, U64{9});
  return joined_parts({{2, cameras}, {3, images}, {6, rigs}, {7, frames}});
}

Seeds colmap_seeds() {
  const CameraSet set = two_cameras();
  return {
      colmap_binary(),

      joined_parts({{0, colmap_cameras_text(set)}, {1, colmap_images_text(set)}}),
      joined_parts({{0, colmap_cameras_text(set)},
                    {1, colmap_images_text(set)},
                    {4, "1 2 CAMERA 1 CAMERA 2 1 1 0 0 0 -4 0 0\n"},
                    {5, "1 1 1 0 0 0 1 2 300 2 CAMERA 1 1 CAMERA 2 2\n"}}),
      joined_parts({{0,
                     "# ours\n1 SIMPLE_RADIAL 64 48 50 32 24 0.1\n2 FULL_OPENCV 64 48 50 50 "
                     "32 24 0.1 0 0 0 0 0 0 0\n"},
                    {1, "1 1 0 0 0 1 2 3 1 a.png\n\n2 0.5 0.5 0.5 0.5 0 0 9 2 b.png\n1 2 -1\n"}})};
}

std::string matrix(const std::string& name, int rows, int columns, const std::string& values) {
  return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
         "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data: [ " + values + " ]\n";
}

// Of pictures as large as the rig's.
CameraSet eyes() {
  CameraSet set = two_cameras();
  for (PosedCamera& camera : set.cameras)
    camera.intrinsics = {.width = 720, .height = 576, .fx = 500, .fy = 501, .cx = 360, .cy = 288};
  return set;
}

Seeds rig_seeds() {
  const std::string lenses = matrix("K1", 3, 3, "500., 0., 360., 0., 501., 288., 0., 0., 1.") +
                             matrix("D1", 1, 5, "-0.1, 0.02, 0., 0., 0.") +
                             matrix("K2", 3, 3, "502., 0., 350., 0., 503., 280., 0., 0., 1.") +
                             matrix("D2", 1, 5, "-0.2, 0., 0., 0., 0.");
  return {"%YAML:1.0\n---\n" + lenses + matrix("R", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.") +
              matrix("T", 3, 1, "-4.5, 0.1, 0."),
          "%YAML:1.0\n---\n" +
              matrix("P1", 3, 4, "500., 0., 360., 0., 0., 500., 288., 0., 0., 0., 1., 0.") +
              matrix("P2", 3, 4, "500., 0., 340., -2250., 0., 500., 288., 0., 0., 0., 1., 0."),
          "K1: [[500, 0, 360], [0, 501, 288], [0, 0, 1]]\nK2: [[502, 0, 350], [0, 503, 280], "
          "[0, 0, 1]]\nD2: [-0.2, 0, 0, 0, 0]\nR: [0, 0, 0]\nT: [-4.5, 0.1, 0]\n",
          "Q: [[1, 0, 0, -360], [0, 1, 0, -288], [0, 0, 0, 500], [0, 0, 0.22, 4]]\n"
          "image_size: [720, 576]\n",
          "K1: [500, 0, 360, 0, 501, 288, 0, 0, 1]\nK2: [502, 0, 350, 0, 503, 280, 0, 0, 1]\n"
          "R1: [[0.8, 0, -0.6], [0, 1, 0], [0.6, 0, 0.8]]\nR2: [0, 0.1, 0]\n"
          "P1: [[500, 0, 360, 0], [0, 500, 288, 0], [0, 0, 1, 0]]\n"
          "P2: [[500, 0, 340, -2250], [0, 500, 288, 0], [0, 0, 1, 0]]\n",
          R"({"width": 720, "height": 576, "M1": [[500, 0, 360], [0, 501, 288], [0, 0, 1]],
              "M2": [[502, 0, 350], [0, 503, 280], [0, 0, 1]], "R": [0, 0.02, 0],
              "T": [-4.5, 0, 0]})",
          cameras_to_json(eyes()),
          transforms_json(eyes())};
}

Seeds rig_text_seeds() {
  return {joined_parts({{0, "500 0 360\n0 501 288\n0 0 1\n"},
                        {1, "-0.1 0.02 0 0 0\n"},
                        {2, "502 0 350\n0 503 280\n0 0 1\n"},
                        {3, "-0.2 0 0 0 0"},
                        {4, "1 0 0 -4.5\n0 1 0 0.1\n0 0 1 0\n0 0 0 1\n"}}),
          joined_parts({{0, "500 0 360\n0 501 288\n0 0 1\n"},
                        {2, "502, 0, 350\n0, 503, 280\n0, 0, 1\n"},
                        {4, "1 0 0\n0 0.8 0.6\n0 -0.6 0.8\n-4.5 0.1 0\n"}})};
}

// Eyes the other way round, one above the other, of another size of picture; a word.
Seeds refused_rig_texts() {
  return {joined_parts({{0, "500 0 360\n0 501 288\n0 0 1\n"},
                        {2, "502 0 350\n0 503 280\n0 0 1\n"},
                        {4, "1 0 0 4.5\n0 1 0 0\n0 0 1 0\n"}}),
          joined_parts({{0, "500 0 360\n0 501 288\n0 0 1\n"},
                        {2, "502 0 350\n0 503 280\n0 0 1\n"},
                        {4, "1 0 0 0\n0 1 0 -4.5\n0 0 1 0\n"}}),
          joined_parts({{0, "500 0 360\n0 501 288\n0 0 1\n"},
                        {2, "502 0 900\n0 503 280\n0 0 1\n"},
                        {4, "1 0 0 -450\n0 1 0 0\n0 0 1 0\n"}}),
          joined_parts({{1, "a word"}, {4, "1 0 0\n0 1\n"}})};
}

const Words kJson = {"\"width\": ",
                     "\"height\": ",
                     "\"fx\": ",
                     "\"camera_from_world\": ",
                     "\"rotation\": ",
                     "\"translation_mm\": ",
                     "\"directions\": ",
                     "\"frames\": ",
                     "\"transform_matrix\": ",
                     "\"file_path\": ",
                     "\"camera_angle_x\": ",
                     "\"w\": ",
                     "\"fl_x\": ",
                     "\"k1\": ",
                     "\"left_out\": ",
                     "null",
                     "[]",
                     "{}",
                     "1e308",
                     "-1",
                     "1e99",
                     "\"\\u0000\"",
                     "true"};
const Words kYaml = {"rows: ",
                     "cols: ",
                     "data: [",
                     "!!opencv-matrix",
                     "dt: d",
                     "&a ",
                     "*a",
                     "<<: ",
                     "? ",
                     "- ",
                     "[[",
                     "{",
                     "|",
                     ">",
                     "\"",
                     "!!binary ",
                     ".nan",
                     ".inf",
                     "1e999",
                     "~",
                     "image_width: ",
                     "<data>",
                     "</rows>",
                     "distortion_model: ",
                     "K1: ",
                     "D1: ",
                     "P1: ",
                     "Q: ",
                     "R: ",
                     "T: "};

}  // namespace

std::vector<FuzzReader> camera_readers() {
  return {
      {"cameras", read_posed, posed_seeds, kJson, 3200},
      {"transforms", read_posed, transforms_seeds, kJson, 3200},
      {"lens", read_lens, lens_seeds, kYaml, 2000, refused_lenses},
      {"colmap",
       read_colmap,
       colmap_seeds,
       {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV", "# ",
        "-1 ", "1e99 ", "nan ", "99999999999 ", kPartMark},
       2000},
      {"stereo-rig", read_rig, rig_seeds, kYaml, 1200},
      {"stereo-texts",
       read_rig_texts,
       rig_text_seeds,
       {"1e308 ", "nan ", "-0 ", "\n\n", kPartMark},
       1200,
       refused_rig_texts},
  };
}

}  // namespace organbake
