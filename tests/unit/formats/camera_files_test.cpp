// SPDX-License-Identifier: GPL-3.0-or-later
// Posed cameras as other programs keep them: written, and read back.
#include "organbake/formats/camera_files.h"

#include "organbake/bundle/bundle_pack.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "posed_cameras.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

void expect_same_cameras(const CameraSet& got, const CameraSet& expected) {
  ASSERT_EQ(got.cameras.size(), expected.cameras.size());
  constexpr double kRounding = 1e-12;  // texts hold every digit; a quaternion's trip loses a few
  for (std::size_t c = 0; c < got.cameras.size(); ++c) {
    const PosedCamera &a = got.cameras[c], &b = expected.cameras[c];
    EXPECT_LT((a.camera_from_world.rotation - b.camera_from_world.rotation).norm(), kRounding);
    EXPECT_LT((a.camera_from_world.translation - b.camera_from_world.translation).norm(), 1e-9);
    EXPECT_EQ(a.intrinsics.width, b.intrinsics.width);
    EXPECT_EQ(a.intrinsics.height, b.intrinsics.height);
    for (const auto member : {&Intrinsics::fx, &Intrinsics::fy, &Intrinsics::cx, &Intrinsics::cy,
                              &Intrinsics::k1, &Intrinsics::p2})
      EXPECT_EQ(a.intrinsics.*member, b.intrinsics.*member);
    EXPECT_EQ(got.images[c], expected.images[c]);
  }
}

TEST(ExportedCameras, ComeBackFromColmap) {
  const TemporaryFolder folder;
  const CameraSet set = two_cameras();
  write_file_atomically(folder.path() / "cameras.txt", colmap_cameras_text(set));
  write_file_atomically(folder.path() / "images.txt", colmap_images_text(set));
  write_file_atomically(folder.path() / "points3D.txt", colmap_points_text());
  expect_same_cameras(read_camera_file(folder.path()), set);
}

// As COLMAP writes a reconstruction by default.
std::vector<std::byte> colmap_cameras_bytes(const CameraSet& set, std::int32_t model) {
  PackedWriter bytes;
  bytes.add(std::uint64_t(set.cameras.size()));
  for (std::size_t c = 0; c < set.cameras.size(); ++c) {
    const Intrinsics& k = set.cameras[c].intrinsics;
    bytes.add(std::uint32_t(c + 1));
    bytes.add(model);
    bytes.add(std::uint64_t(k.width));
    bytes.add(std::uint64_t(k.height));
    for (const double value : {k.fx, k.fy, k.cx, k.cy, k.k1, k.k2, k.p1, k.p2, k.k3, 0., 0., 0.})
      bytes.add(value);
  }
  return bytes.take();
}

std::vector<std::byte> colmap_images_bytes(const CameraSet& set) {
  PackedWriter bytes;
  bytes.add(std::uint64_t(set.cameras.size()));
  for (std::size_t c = 0; c < set.cameras.size(); ++c) {
    const RigidTransform& pose = set.cameras[c].camera_from_world;
    const Eigen::Quaterniond q(pose.rotation);
    bytes.add(std::uint32_t(7 + c));
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) bytes.add(value);
    for (int axis = 0; axis < 3; ++axis) bytes.add(pose.translation[axis]);
    bytes.add(std::uint32_t(c + 1));
    for (const char letter : set.images[c]) bytes.add(letter);
    bytes.add('\0');
    bytes.add(std::uint64_t(c));  // points
    for (std::size_t i = 0; i < 3 * c; ++i) bytes.add(1.5);
  }
  return bytes.take();
}

TEST(ExportedCameras, ColmapsBinaryModelsAreReadAsItsTexts) {
  constexpr std::int32_t kFullOpenCv = 6, kFov = 7;
  const TemporaryFolder folder;
  const CameraSet set = two_cameras();
  const fs::path sparse = folder.path() / "sparse" / "0";
  fs::create_directories(sparse);
  const std::vector<std::byte> images = colmap_images_bytes(set);
  write_file_atomically(sparse / "cameras.bin", colmap_cameras_bytes(set, kFullOpenCv));
  write_file_atomically(sparse / "images.bin", images);
  expect_same_cameras(read_camera_file(folder.path()), set);
  expect_same_cameras(read_camera_file(sparse / "images.bin"), set);
  write_file_atomically(sparse / "images.bin", std::span(images).first(images.size() - 30));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_camera_file(sparse); }),
              testing::HasSubstr("ends early"));
  write_file_atomically(sparse / "cameras.bin", colmap_cameras_bytes(set, kFov));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_camera_file(sparse); }),
              testing::HasSubstr("model number 7; read are SIMPLE_PINHOLE, PINHOLE"));
}

std::string pose_text(const RigidTransform& pose) {
  const Eigen::Quaterniond q(pose.rotation);
  std::string text;
  for (const double value : {q.w(), q.x(), q.y(), q.z(), pose.translation.x(), pose.translation.y(),
                             pose.translation.z()})
    text += " " + to_text(value);
  return text;
}

void add_pose(const RigidTransform& pose, PackedWriter& bytes) {
  const Eigen::Quaterniond q(pose.rotation);
  for (const double value : {q.w(), q.x(), q.y(), q.z(), pose.translation.x(), pose.translation.y(),
                             pose.translation.z()})
    bytes.add(value);
}

// A rig of two cameras in one frame, the first of which says where the rig is, as COLMAP writes it
// since 3.12; images.txt holds the poses of before the frames were moved.
class ColmapRigs : public testing::Test {
 protected:
  ColmapRigs() {
    for (PosedCamera& camera : stale_.cameras)
      camera.camera_from_world.translation += Eigen::Vector3d(0, 0, 40);
    const RigidTransform &first = set_.cameras[0].camera_from_world,
                         &second = set_.cameras[1].camera_from_world;
    rig_from_world_ = first;
    second_from_rig_ = second * first.inverse();
  }
  CameraSet read() {
    const RunContext context([&](LogLevel, std::string_view text) { said_ += text; }, {}, nullptr);
    return read_camera_file(folder_.path(), context);
  }
  void write(const std::string& name, const std::string& text) {
    write_file_atomically(folder_.path() / name, text);
  }

  const TemporaryFolder folder_;
  const CameraSet set_ = two_cameras();
  CameraSet stale_ = set_;
  RigidTransform rig_from_world_, second_from_rig_;
  std::string said_;
};

TEST_F(ColmapRigs, TextsAreReadByTheirFrames) {
  write("cameras.txt", colmap_cameras_text(set_));
  write("images.txt", colmap_images_text(stale_));
  write("rigs.txt", "# one\n5 2 CAMERA 1 CAMERA 2 1" + pose_text(second_from_rig_) + "\n");
  const std::string frame = "9 5" + pose_text(rig_from_world_);
  write("frames.txt", frame + " 2 CAMERA 1 1 CAMERA 2 2\n");
  expect_same_cameras(read(), set_);
  EXPECT_THAT(said_, testing::HasSubstr("the poses of 2 of its 2 images differ from those of the "
                                        "frames and rigs, by 40.000 mm and 0.000°"));
  said_.clear();
  write("images.txt", colmap_images_text(set_));
  expect_same_cameras(read(), set_);
  EXPECT_EQ(said_, "") << "both say the same";
  const auto error = [&] { return message_of(ExitCode::bad_data, [&] { read(); }); };
  write("frames.txt", frame + " 1 CAMERA 1 1\n");
  EXPECT_THAT(error(), testing::HasSubstr("image 2 stands in no frame of frames.txt"));
  write("frames.txt", frame + " 2 CAMERA 1 1\n");
  EXPECT_THAT(error(), testing::HasSubstr("ends early"));
  write("frames.txt", frame + " 2 CAMERA 1 1 CAMERA 3 2\n");
  EXPECT_THAT(error(), testing::HasSubstr("rig 5 does not say where its camera 3 is"));
  write("rigs.txt", ""), write("frames.txt", "");
  expect_same_cameras(read(), set_);
}

TEST_F(ColmapRigs, BinaryFilesAreReadByTheirFrames) {
  constexpr std::int32_t kFullOpenCv = 6, kCamera = 0, kInertial = 1;
  write_file_atomically(folder_.path() / "cameras.bin", colmap_cameras_bytes(set_, kFullOpenCv));
  write_file_atomically(folder_.path() / "images.bin", colmap_images_bytes(stale_));
  PackedWriter rigs, frames;
  rigs.add(std::uint64_t{1});
  rigs.add(std::uint32_t{5}), rigs.add(std::uint32_t{3});
  rigs.add(kCamera), rigs.add(std::uint32_t{1});
  rigs.add(kCamera), rigs.add(std::uint32_t{2}), rigs.add(std::uint8_t{1});
  add_pose(second_from_rig_, rigs);
  rigs.add(kInertial), rigs.add(std::uint32_t{3}), rigs.add(std::uint8_t{0});
  frames.add(std::uint64_t{1});
  frames.add(std::uint32_t{9}), frames.add(std::uint32_t{5});
  add_pose(rig_from_world_, frames);
  frames.add(std::uint32_t{3});
  for (const std::uint32_t sensor : {1u, 2u, 3u}) {
    frames.add(sensor == 3 ? kInertial : kCamera), frames.add(sensor);
    frames.add(std::uint64_t{6 + sensor});
  }
  write_file_atomically(folder_.path() / "rigs.bin", rigs.bytes());
  write_file_atomically(folder_.path() / "frames.bin", frames.bytes());
  expect_same_cameras(read(), set_);
  EXPECT_THAT(said_, testing::HasSubstr("by 40.000 mm"));
}

TEST_F(ColmapRigs, OfAModelThatIsThereTwiceTheBinaryOneIsRead) {
  constexpr std::int32_t kFullOpenCv = 6;
  write_file_atomically(folder_.path() / "cameras.bin", colmap_cameras_bytes(set_, kFullOpenCv));
  write_file_atomically(folder_.path() / "images.bin", colmap_images_bytes(set_));
  write("cameras.txt", colmap_cameras_text(set_));
  write("images.txt", colmap_images_text(set_));
  expect_same_cameras(read(), set_);
  EXPECT_EQ(said_, "") << "both say the same";
  write("images.txt", colmap_images_text(stale_));
  expect_same_cameras(read(), set_);
  EXPECT_THAT(said_, testing::HasSubstr("holds two models that differ"));
}

TEST(ExportedCameras, ColmapsNamesOfImagesMayHoldSpaces) {
  const TemporaryFolder folder;
  CameraSet set = two_cameras();
  set.images[0] = "left eye/frame 001.png";
  write_file_atomically(folder.path() / "cameras.txt", colmap_cameras_text(set));
  write_file_atomically(folder.path() / "images.txt", colmap_images_text(set));
  expect_same_cameras(read_camera_file(folder.path()), set);
}

TEST(ExportedCameras, ColmapPointsAndSightingsPointAtEachOther) {
  const TemporaryFolder folder;
  const CameraSet set = two_cameras();
  std::vector<SparsePoint> points(3);
  points[0] = {{1, 2, 3}, {10, 20, 30}, {{0, {4.5, 5.25}}, {1, {6.5, 7.125}}}};
  points[1] = {{-1, 0.5, 2.25}, {255, 0, 7}, {}};
  points[2] = {{4, 5, 6}, {1, 2, 3}, {{1, {8, 9}}}};
  const fs::path sparse = folder.path() / "sparse" / "0";
  fs::create_directories(sparse);
  write_file_atomically(sparse / "cameras.txt", colmap_cameras_text(set));
  write_file_atomically(sparse / "images.txt", colmap_images_text(set, points));
  expect_same_cameras(read_camera_file(folder.path()), set);
  EXPECT_THAT(colmap_images_text(set, points),
              testing::AllOf(testing::HasSubstr("cam_000.png\n4.500 5.250 1\n"),
                             testing::HasSubstr("cam_001.png\n6.500 7.125 1 8.000 9.000 3\n")));
  EXPECT_THAT(colmap_points_text(points),
              testing::AllOf(testing::HasSubstr("\n1 1.00000 2.00000 3.00000 10 20 30 0 1 0 2 0\n"),
                             testing::HasSubstr("\n2 -1.00000 0.50000 2.25000 255 0 7 0\n"),
                             testing::HasSubstr("\n3 4.00000 5.00000 6.00000 1 2 3 0 2 1\n")));
}

TEST(ExportedCameras, TransformsPutTheOrganIntoTheUnitCube) {
  const CameraSet set = two_cameras();
  SceneFacts facts{{{-10, 20, 30}, {90, 60, 130}}, 0.02, {"depth/a.png", "depth/b.png"}, "p.ply"};
  const auto json = nlohmann::json::parse(transforms_json(set, facts));
  for (int k = 0; k < 3; ++k) {
    const double scale = json["scale"], offset = json["offset"][k];
    EXPECT_NEAR(scale * facts.bounds_mm.center()[k] + offset, 0.5, 1e-12);
    EXPECT_GT(scale * facts.bounds_mm.min[k] + offset, 0);
    EXPECT_LT(scale * facts.bounds_mm.max[k] + offset, 1);
  }
  EXPECT_EQ(json["integer_depth_scale"], 0.02);
  EXPECT_EQ(json["frames"][1]["depth_file_path"], "depth/b.png");
  EXPECT_EQ(json["ply_file_path"], "p.ply");
  EXPECT_EQ(json["bounds_mm"][1][2], 130);
}

TEST(ExportedCameras, PointsAreAPlyCloud) {
  const std::string ply =
      point_cloud_ply({{{1, 2, 3}, {10, 20, 30}, {}}, {{4, 5, 6}, {7, 8, 9}, {}}});
  const std::size_t body = ply.find("end_header\n") + 11;
  ASSERT_EQ(ply.size() - body, 2u * 15);
  float z = 0;
  std::memcpy(&z, ply.data() + body + 15 + 8, 4);
  EXPECT_EQ(z, 6);
  EXPECT_EQ(ply.back(), 9);
}

TEST(ExportedCameras, ANameThatIsNoUtf8IsRefused) {
  const TemporaryFolder folder;
  CameraSet set = two_cameras();
  set.images.front() = "caf\xe9.png";  // Latin-1
  write_file_atomically(folder.path() / "cameras.txt", colmap_cameras_text(set));
  write_file_atomically(folder.path() / "images.txt", colmap_images_text(set));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_camera_file(folder.path()); }),
              testing::HasSubstr("image 1 is no UTF-8"));
}

TEST(ExportedCameras, ComeBackFromTransforms) {
  const TemporaryFolder folder;
  const CameraSet set = two_cameras();
  write_file_atomically(folder.path() / "transforms.json", transforms_json(set));
  expect_same_cameras(read_camera_file(folder.path() / "transforms.json"), set);
}

}  // namespace
}  // namespace organbake
