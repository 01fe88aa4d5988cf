// SPDX-License-Identifier: Apache-2.0

#include <sys/stat.h>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

class BundleFolder : public testing::Test {
 protected:
  void SetUp() override { write_bundle(path(), small_bundle()); }
  fs::path path() const { return folder_.path() / "b"; }

  // The message of the error that reading everything ends with.
  std::string refusal() const {
    try {
      BundleReader(path()).verify();
    } catch (const BadDataError& error) {
      return error.what();
    }
    return "accepted";
  }
  void edit_manifest(const std::string& from, const std::string& to) const {
    std::string text = read_text_file(path() / "manifest.json");
    ASSERT_NE(text.find(from), std::string::npos) << from;
    write_file_atomically(path() / "manifest.json", text.replace(text.find(from), from.size(), to));
  }
  // Writes a bundle that is wrong inside, with checksums that agree.
  template <typename Change>
  std::string refusal_after(Change change) {
    Bundle bundle = small_bundle();
    change(bundle);
    fs::remove_all(path());
    write_bundle(path(), bundle);
    return refusal();
  }

  TemporaryFolder folder_;
};

TEST_F(BundleFolder, IsReadBackExactly) {
  const Bundle expected = small_bundle(), bundle = BundleReader(path()).read_all();
  EXPECT_EQ(bundle.proxy.vertices, expected.proxy.vertices);
  ASSERT_EQ(bundle.maps.size(), 2u);
  EXPECT_EQ(bundle.maps[1].depth_mm, expected.maps[1].depth_mm);
  EXPECT_EQ(bundle.maps[1].color, expected.maps[1].color);
  EXPECT_EQ(bundle.maps[1].height_mm, expected.maps[1].height_mm);
  EXPECT_EQ(bundle.maps[1].face, expected.maps[1].face);
  EXPECT_EQ(bundle.base.height_mm, expected.base.height_mm);
  EXPECT_EQ(bundle.manifest.name, "small");
  EXPECT_EQ(refusal(), "accepted");
}

TEST_F(BundleFolder, AFlippedByteInAnyFileIsNamed) {
  for (const auto& file : list_files(path())) {
    if (file == "manifest.json") continue;
    auto bytes = read_file(path() / file);
    bytes[bytes.size() / 2] ^= std::byte{1};
    write_file_atomically(path() / file, bytes);
    EXPECT_NE(refusal().find(file.string()), std::string::npos) << file;
    bytes[bytes.size() / 2] ^= std::byte{1};
    write_file_atomically(path() / file, bytes);
  }
  EXPECT_EQ(refusal(), "accepted");
}

TEST_F(BundleFolder, AFlippedByteInTheManifestIsNeverTrusted) {
  const auto good = read_file(path() / "manifest.json");
  for (std::size_t i = 0; i < good.size(); i += 7) {
    auto bad = good;
    bad[i] ^= std::byte{1};
    write_file_atomically(path() / "manifest.json", bad);
    EXPECT_NE(refusal().find("manifest.json"), std::string::npos) << i;
  }
}

TEST_F(BundleFolder, PathsStayInside) {
  for (const char* evil : {"../proxy.ply", "/etc/passwd", "cam_000/../../x", "", "./base.exr"}) {
    SetUp();
    edit_manifest("\"base.exr\"", std::string("\"") + evil + "\"");
    EXPECT_NE(refusal().find("inside the bundle"), std::string::npos) << evil;
  }
}

TEST_F(BundleFolder, NestingWithoutEndIsRefused) {
  edit_manifest("\"seeds\": ", "\"deep\": " + std::string(1000000, '['));
  EXPECT_NE(refusal().find("nested too deeply"), std::string::npos);
}

TEST_F(BundleFolder, ALinkOutOfTheBundleIsRefused) {
  const fs::path outside = folder_.path() / "outside.ply";
  fs::rename(path() / "proxy.ply", outside);
  fs::create_symlink(outside, path() / "proxy.ply");
  EXPECT_NE(refusal().find("proxy.ply"), std::string::npos);
}

TEST_F(BundleFolder, ACamerasFolderThatIsALinkIsRefused) {
  fs::rename(path() / "cam_001", folder_.path() / "outside");
  fs::create_directory_symlink("../outside", path() / "cam_001");
  EXPECT_NE(refusal().find("cam_001"), std::string::npos);
  EXPECT_THROW(BundleReader(path()).read_all(), BadDataError);
}

// Each would keep a reader waiting for ever, or give it something without end.
TEST_F(BundleFolder, WhatIsNoFileIsRefusedUnderEveryName) {
  for (const char* name : {"manifest.json", "proxy.ply", "mechanics.json", "cam_000/depth.exr"}) {
    SetUp();
    fs::remove(path() / name);
    ASSERT_EQ(::mkfifo((path() / name).c_str(), 0600), 0);
    EXPECT_NE(refusal().find(name), std::string::npos) << name;
    fs::remove(path() / name);
    fs::create_directory(path() / name);
    EXPECT_NE(refusal().find(name), std::string::npos) << name;
    fs::remove(path() / name);
  }
  SetUp();
  ASSERT_EQ(::mkfifo((path() / "stray").c_str(), 0600), 0);
  EXPECT_NE(refusal().find("stray"), std::string::npos);
}

TEST_F(BundleFolder, MissingAndUnlistedFilesAreNamed) {
  fs::remove(path() / "cam_001" / "color.exr");
  EXPECT_NE(refusal().find("color.exr"), std::string::npos);
  SetUp();
  std::ofstream(path() / "stray.txt") << "x";
  EXPECT_NE(refusal().find("stray.txt"), std::string::npos);
}

TEST_F(BundleFolder, WrongContentWithRightChecksumsIsRefused) {
  const auto says = [](const std::string& message, const char* part) {
    return message.find(part) != std::string::npos;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(says(refusal_after([&](Bundle& b) { b.proxy.vertices[2].x() = nan; }), "not finite"));
  EXPECT_TRUE(says(refusal_after([](Bundle& b) { b.proxy.faces[0][0] = 77; }), "vertex 77"));
  EXPECT_TRUE(says(refusal_after([](Bundle& b) { b.maps[0].face[5] = 4; }), "face"));
  EXPECT_TRUE(says(refusal_after([](Bundle& b) { b.maps[0].depth_mm[5] = -1; }), "depth"));
  EXPECT_TRUE(says(refusal_after([](Bundle& b) { b.maps[0].height_mm[5] = NAN; }), "height"));
  EXPECT_TRUE(says(refusal_after([](Bundle& b) { b.maps[0].confidence[5] = 1.5f; }), "confidence"));
  EXPECT_TRUE(
      says(refusal_after([](Bundle& b) { b.maps[0].width = 6, b.maps[0].height = 8; }), "8 × 6"));
  EXPECT_TRUE(says(refusal_after([](Bundle& b) {
                     b.base.steps = 1;
                     b.base.face_count = 8;
                   }),
                   "rows"));
  EXPECT_TRUE(
      says(refusal_after([](Bundle& b) { b.cameras.manifold.directions.clear(); }), "manifold"));
  EXPECT_TRUE(says(refusal_after([](Bundle& b) { b.mechanics.springs[0].a = 9; }), "springs/0/a"));
}

TEST_F(BundleFolder, AHugeClaimIsRefusedBeforeMemoryIsTaken) {
  Bundle bundle = small_bundle();
  bundle.cameras.cameras[0].intrinsics.width = 65536;
  bundle.cameras.cameras[0].intrinsics.height = 65536;  // 2³² pixels claimed, 48 there
  fs::remove_all(path());
  write_bundle(path(), bundle);
  EXPECT_NE(refusal().find("65536"), std::string::npos);
}

TEST(BundleReaderTest, NamesAFolderThatIsNoBundle) {
  const TemporaryFolder folder;
  EXPECT_THROW(BundleReader{folder.path()}, NoInputError);
  EXPECT_THROW(BundleReader{folder.path() / "missing"}, NoInputError);
}

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

TEST(BaseNodeIndex, CountsEveryNodeOnceInOrder) {
  for (std::uint32_t n : {1u, 2u, 7u, 64u}) {
    std::uint32_t expected = 0;
    for (std::uint32_t i = 0; i <= n; ++i) {
      for (std::uint32_t j = 0; i + j <= n; ++j) EXPECT_EQ(base_node_index(n, i, j), expected++);
    }
    EXPECT_EQ(expected, (n + 1) * (n + 2) / 2);
  }
}

TEST(BaseLayer, SurvivesItsImage) {
  BaseLayer layer{3, 2, {}, {}, {}};
  for (std::uint32_t i = 0; i < 2 * layer.nodes_per_face(); ++i) {
    layer.height_mm.push_back(0.5f * static_cast<float>(i));
    layer.color.emplace_back(0.25f, 0.5f, static_cast<float>(i) / 32);
    layer.seen_by.push_back(i * 7);
  }
  const BaseLayer back = base_layer_from_image(base_layer_to_image(layer), "base", 2);
  EXPECT_EQ(back.steps, 3u);
  EXPECT_EQ(back.height_mm, layer.height_mm);
  EXPECT_EQ(back.color, layer.color);
  EXPECT_EQ(back.seen_by, layer.seen_by);
}

TEST(BaseLayer, RefusesOtherShapes) {
  BaseLayer layer{1, 2, std::vector<float>(6), std::vector<Eigen::Vector3f>(6, {0, 0, 0}),
                  std::vector<std::uint32_t>(6)};
  ChannelImage image = base_layer_to_image(layer);
  EXPECT_THROW(base_layer_from_image(image, "base", 3), BadDataError);
  ChannelImage narrow = image;
  narrow.width = 4;  // no triangular number
  EXPECT_THROW(base_layer_from_image(narrow, "base", 2), BadDataError);
  layer.height_mm[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(base_layer_from_image(base_layer_to_image(layer), "base", 2), BadDataError);
}

}  // namespace
}  // namespace organbake
