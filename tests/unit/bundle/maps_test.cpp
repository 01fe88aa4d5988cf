// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/stored_maps.h"

#include "organbake/bundle/bundle_reader.h"
#include "organbake/bundle/skin_image.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/core/temporary_files.h"
#include "organbake/image/exr.h"
#include "support/error_message.h"
#include "support/meshes.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

constexpr int kSide = 40;
constexpr std::size_t kFaces = 30;
const Intrinsics kMapLens{kSide, kSide, 50, 50, 20, 20};

int byte_of(float share) { return static_cast<int>(255 * std::min(share, 1.0f) + 0.5f); }

// A wavy surface with a hole, an edge and noise of the colours.
CameraMaps wavy_maps() {
  RandomStream random(3);
  CameraMaps maps;
  maps.width = maps.height = kSide;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const bool there = std::hypot(x - 18, y - 22) < 17 && std::hypot(x - 12, y - 20) > 3;
      const double behind = x > 25 ? 30 : 0;
      maps.depth_mm.push_back(there ? float(100 + behind + 3 * std::sin(0.2 * x) + 0.1 * y)
                                    : std::numeric_limits<float>::infinity());
      maps.height_mm.push_back(there ? float(random.uniform(-2, 5)) : 0);
      maps.face.push_back(there ? std::uint32_t(x / 8 + 5 * (y / 8)) : kNoFace);
      maps.confidence.push_back(there ? float(random.uniform()) : 0);
      maps.color.emplace_back(Eigen::Vector3f::Zero());
      for (int k = 0; k < 3 && there; ++k) maps.color.back()[k] = float(random.uniform(-0.1, 1.2));
    }
  }
  return maps;
}

class MapCode : public testing::Test {
 protected:
  CameraMaps maps = wavy_maps();
  std::vector<std::byte> code = coded_maps(maps, kMapLens);
  CameraMaps back() const { return decoded_maps(code, kMapLens, kFaces, "maps"); }
};

TEST_F(MapCode, GivesBackWhatThePlayerMakesOfTheMaps) {
  const CameraMaps again = back();
  int drawn = 0;
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    const bool there = maps.face[i] != kNoFace && byte_of(maps.confidence[i]) > 0;
    ASSERT_EQ(again.face[i], there ? maps.face[i] : kNoFace) << i;
    if (!there) {
      EXPECT_TRUE(std::isinf(again.depth_mm[i]));
      continue;
    }
    ++drawn;
    EXPECT_EQ(byte_of(again.confidence[i]), byte_of(maps.confidence[i]));
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(byte_of(std::sqrt(again.color[i][k])),
                byte_of(std::sqrt(std::max(0.0f, maps.color[i][k]))));
    }
    // Half a step: a texel here is 2.2 mm wide.
    EXPECT_NEAR(again.depth_mm[i], maps.depth_mm[i], 2.5 / 256);
    EXPECT_NEAR(again.height_mm[i], maps.height_mm[i], 2.5 / 256);
  }
  EXPECT_GT(drawn, 500);
}

TEST_F(MapCode, CodesWhatItGaveBackToTheSameBytes) {
  EXPECT_EQ(coded_maps(back(), kMapLens).size(), code.size());
  const CameraMaps once = back(),
                   twice = decoded_maps(coded_maps(once, kMapLens), kMapLens, kFaces, "maps");
  EXPECT_EQ(once.face, twice.face);
  EXPECT_EQ(once.color, twice.color);
  EXPECT_EQ(once.confidence, twice.confidence);
}

TEST_F(MapCode, KeepsARangeOfMetresWithin65535Steps) {
  maps.depth_mm[20 * kSide + 20] = 5000;
  code = coded_maps(maps, kMapLens);
  EXPECT_NEAR(back().depth_mm[20 * kSide + 20], 5000, 4900.0 / 65533);
}

TEST_F(MapCode, TakesMapsOfNothing) {
  std::fill(maps.face.begin(), maps.face.end(), kNoFace);
  code = coded_maps(maps, kMapLens);
  const CameraMaps again = back();
  EXPECT_EQ(std::count(again.face.begin(), again.face.end(), kNoFace), kSide * kSide);
}

TEST_F(MapCode, RefusesAnotherSizeAndFacesThatAreNotThere) {
  Intrinsics other = kMapLens;
  other.width = kSide + 1;
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { decoded_maps(code, other, kFaces, "maps"); }),
              testing::HasSubstr("maps: is 40 × 40, its camera 41 × 40"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { decoded_maps(code, kMapLens, 5, "maps"); }),
              testing::HasSubstr("names a face"));
}

TEST_F(MapCode, RefusesEveryLengthButItsOwn) {
  for (std::size_t length = 0; length < code.size(); length += 7) {
    const auto shorter = std::span(code).first(length);
    EXPECT_THROW(decoded_maps(shorter, kMapLens, kFaces, "maps"), BadDataError) << length;
  }
  code.push_back(std::byte{0});
  EXPECT_THROW(back(), BadDataError);
}

constexpr int kFileSide = 40;

// A tilted plane about 300 mm away with a background, heights of a few mm, a smooth colour.
CameraMaps some_maps() {
  CameraMaps maps;
  maps.width = maps.height = kFileSide;
  for (int y = 0; y < kFileSide; ++y) {
    for (int x = 0; x < kFileSide; ++x) {
      const bool filled = x > 3 && y > 2;
      maps.depth_mm.push_back(filled ? 300.123f + 0.377f * x - 0.19f * y
                                     : std::numeric_limits<float>::infinity());
      maps.height_mm.push_back(filled ? 3.7f * std::sin(0.3f * x + 0.2f * y) : 0.0f);
      maps.face.push_back(filled ? std::uint32_t(x / 5) : kNoFace);
      maps.confidence.push_back(filled ? 0.5f : 0.0f);
      maps.color.emplace_back(filled ? 0.4f + 0.005f * x : 0, filled ? 0.2f : 0, filled ? 0.1f : 0);
    }
  }
  return maps;
}

struct Written {
  ChannelImage depth, color, micro;
};

Written written_with(const MapPacking& packing) {
  const TemporaryFolder folder;
  PosedCamera camera;
  camera.intrinsics = {kFileSide, kFileSide, 100, 100, 20, 20};
  BaseLayer base;
  base.steps = base.face_count = 1;
  base.height_mm.assign(3, 0);
  base.color.assign(3, Eigen::Vector3f::Zero());
  base.seen_by.assign(3, 0);
  write_map_files(folder.path(), {some_maps()}, {camera}, base, packing);
  EXPECT_EQ(list_files(folder.path()).size(), 4u);
  const auto read = [&](const char* name) { return read_exr(folder.path() / "cam_000" / name); };
  return {read("depth.exr"), read("color.exr"), read("micro.exr")};
}

TEST(MapFiles, ExactPackingsGiveTheMapsBack) {
  const CameraMaps maps = some_maps();
  for (const ExrCompression compression :
       {ExrCompression::none, ExrCompression::zip, ExrCompression::piz}) {
    const Written files = written_with({.compression = compression});
    EXPECT_EQ(files.depth.floats("Y", "depth"), maps.depth_mm);
    EXPECT_EQ(files.depth.floats("Z", "depth"), maps.depth_mm);
    EXPECT_EQ(files.micro.floats("Y", "micro"), maps.height_mm);
    EXPECT_EQ(files.micro.uints("face", "micro"), maps.face);
  }
}

// PXR24 keeps 16 bits after a float's leading one: half a step is 2^-17 of the value's power of 2.
constexpr double kPxr24Depth = 256.0 / (1 << 16), kPxr24Height = 2.0 / (1 << 16);
// DWAA's default is made to be invisible: a few hundredths of a colour of 0.5, linear.
constexpr double kDwaaColor = 0.03;

TEST(MapFiles, CompactIsAsExactAsItSays) {
  const CameraMaps maps = some_maps();
  const Written files = written_with({.compact = true});
  const auto& depth = files.depth.floats("Y", "depth");
  const auto& height = files.micro.floats("Y", "micro");
  const auto& red = files.color.floats("R", "color");
  EXPECT_EQ(files.micro.uints("face", "micro"), maps.face);
  bool lost_bits = false;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (maps.face[i] == kNoFace) {
      EXPECT_TRUE(std::isinf(depth[i]));
      continue;
    }
    EXPECT_NEAR(depth[i], maps.depth_mm[i], kPxr24Depth);
    EXPECT_NEAR(height[i], maps.height_mm[i], kPxr24Height);
    EXPECT_NEAR(red[i], maps.color[i][0], kDwaaColor);
    lost_bits = lost_bits || depth[i] != maps.depth_mm[i];
  }
  EXPECT_TRUE(lost_bits) << "this is not compact";
}

TEST(SkinImage, SurvivesItsImage) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  const SmoothSkin skin = flat_skin(proxy, 3);
  const SmoothSkin back = skin_from_image(skin_to_image(skin), "skin", proxy);
  EXPECT_EQ(back.steps, 3u);
  EXPECT_EQ(back.first, skin.first);
  EXPECT_EQ(back.carrier, skin.carrier);
  ASSERT_EQ(back.weight.size(), skin.weight.size());
  for (std::size_t k = 0; k < skin.weight.size(); ++k)
    EXPECT_NEAR(back.weight[k], skin.weight[k], 1e-6) << "weights are stored as floats";
}

TEST(SkinImage, OtherShapesAreRefused) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  const ChannelImage image = skin_to_image(flat_skin(proxy, 3));
  EXPECT_THROW(skin_from_image(image, "skin", lumpy_mesh(40, 2)), BadDataError);
  SmoothSkin skin = flat_skin(proxy, 3);
  skin.weight[7] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(skin_from_image(skin_to_image(skin), "skin", proxy), BadDataError);
}

// An older player would bind the samples to the proxy: it has to refuse.
TEST(SkinImage, ABundleWithASkinHasAVersionOfItsOwn) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "skin_bundle";
  std::filesystem::remove_all(folder);
  Bundle bundle = small_bundle();
  write_bundle(folder, bundle);
  EXPECT_FALSE(BundleReader(folder).read_frame().skin);
  bundle.skin = flat_skin(bundle.proxy, 2);
  bundle.base.face_count = 16;
  bundle.base.height_mm.resize(16 * 6), bundle.base.seen_by.resize(16 * 6);
  bundle.base.color.resize(16 * 6, {0, 0, 0});
  write_bundle(folder, bundle);
  const Bundle back = BundleReader(folder).read_frame();
  EXPECT_NE(read_text_file(folder / "manifest.json").find("organbake/bundle/2"), std::string::npos);
  ASSERT_TRUE(back.skin);
  EXPECT_EQ(back.skin->carrier, bundle.skin->carrier);
  EXPECT_EQ(back.shell().at_rest().faces.size(), 4 * bundle.proxy.faces.size());
}

}  // namespace
}  // namespace organbake
