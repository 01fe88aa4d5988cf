// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/bundle_reader.h"

#include "organbake/bundle/bundle_pack.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/image/exr.h"
#include "support/error_message.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Every texel that shows something lies in the plane of a face: depth and height agree.
void lay_on_faces(Bundle& bundle) {
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    const PosedCamera& camera = bundle.cameras.cameras[c];
    const RigidTransform world_from_camera = camera.camera_from_world.inverse();
    CameraMaps& maps = bundle.maps[c];
    for (std::size_t i = 0; i < maps.face.size(); ++i) {
      if (maps.face[i] == kNoFace) continue;
      const Eigen::Vector2d pixel(i % maps.width + 0.5, i / maps.width + 0.5);
      const Eigen::Vector3d ray = world_from_camera.rotation * unproject(camera.intrinsics, pixel);
      maps.height_mm[i] = 0;
      for (std::uint32_t f = 0; f < bundle.proxy.faces.size(); ++f) {
        const Eigen::Vector3d n = face_normal(bundle.proxy, f);
        const Eigen::Vector3d& on = bundle.proxy.vertices[bundle.proxy.faces[f][0]];
        const double depth = n.dot(on - world_from_camera.translation) / n.dot(ray);
        if (!(depth > 1 && depth < 100)) continue;
        maps.face[i] = f;
        maps.depth_mm[i] = static_cast<float>(depth);
      }
    }
  }
}

class EditedBundle : public testing::Test {
 protected:
  void SetUp() override {
    lay_on_faces(bundle_);
    write_bundle(path(), bundle_);
  }
  fs::path path() const { return folder_.path() / "b"; }
  fs::path camera(int c) const { return path() / camera_folder(c); }
  std::string refusal() const {
    const std::string before = read_text_file(path() / "manifest.json");
    const std::string message = message_of(ExitCode::bad_data, [&] { reseal(path()); });
    EXPECT_EQ(read_text_file(path() / "manifest.json"), before);
    return message;
  }
  void write_manifest_of(const ResealedBundle& resealed) const {
    write_file_atomically(path() / "manifest.json", manifest_to_json(resealed.manifest));
  }

  Bundle bundle_ = small_bundle();
  TemporaryFolder folder_;
};

TEST_F(EditedBundle, UntouchedKeepsItsManifest) {
  const ResealedBundle resealed = reseal(path());
  EXPECT_TRUE(resealed.changed.empty());
  EXPECT_EQ(manifest_to_json(resealed.manifest), read_text_file(path() / "manifest.json"));
}

TEST_F(EditedBundle, PaintedColoursAreTakenOverAndTold) {
  bundle_.maps[1].color[5] = {0.9f, 0.1f, 0.1f};
  write_exr(camera(1) / "color.exr", color_image(bundle_.maps[1]));
  EXPECT_THROW(BundleReader(path()).verify(), BadDataError);
  const ResealedBundle resealed = reseal(path());
  EXPECT_THAT(resealed.changed, ElementsAre("cam_001/color.exr"));
  write_manifest_of(resealed);
  const BundleReader reader(path());
  reader.verify();
  EXPECT_NEAR(reader.read_all().maps[1].color[5].x(), 0.9, 1e-3) << "stored as a half";
  EXPECT_THAT(reader.manifest().edited, ElementsAre("cam_001/color.exr"));

  // A second edit is told beside the first.
  bundle_.base.color[0] = {1, 0, 0};
  write_exr(path() / "base.exr", base_layer_to_image(bundle_.base));
  write_manifest_of(reseal(path()));
  EXPECT_THAT(BundleReader(path()).manifest().edited, ElementsAre("base.exr", "cam_001/color.exr"));
  EXPECT_TRUE(reseal(path()).changed.empty());
}

TEST_F(EditedBundle, ConfidenceMayBeEditedWhereDepthAndHeightStillAgree) {
  bundle_.maps[0].confidence[5] = 0.25f;
  write_exr(camera(0) / "micro.exr", micro_image(bundle_.maps[0]));
  EXPECT_THAT(reseal(path()).changed, ElementsAre("cam_000/micro.exr"));
  bundle_.maps[0].depth_mm[5] += 3;
  write_exr(camera(0) / "depth.exr", depth_image(bundle_.maps[0]));
  EXPECT_THAT(refusal(),
              testing::AllOf(HasSubstr("cam_000"), HasSubstr("texel (5, 0)"), HasSubstr("places")));
}

TEST_F(EditedBundle, DepthsNamedYAndZMustNotDiffer) {
  ChannelImage depth = depth_image(bundle_.maps[0]);
  auto& z = std::get<std::vector<float>>(depth.channels[1].values);
  z[5] += 0.001f;
  write_exr(camera(0) / "depth.exr", depth);
  EXPECT_THAT(refusal(), HasSubstr("Y and Z"));
}

TEST_F(EditedBundle, WhatNoMapIsIsRefused) {
  const auto rewritten = [&](const char* file) {
    SetUp();
    std::ofstream(path() / file, std::ios::app) << "\n";
    return refusal();
  };
  for (const char* file : {"proxy.ply", "cameras.json", "mechanics.json"})
    EXPECT_THAT(rewritten(file), testing::AllOf(HasSubstr(file), HasSubstr("was changed")));
  SetUp();
  std::ofstream(path() / "cam_000" / "color.exr~") << "a painter's copy";
  EXPECT_THAT(refusal(), HasSubstr("color.exr~"));
  fs::remove(path() / "cam_000" / "color.exr~");
  fs::remove(path() / "cam_000" / "color.exr");
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr("color.exr"), HasSubstr("is missing")));
}

TEST_F(EditedBundle, AnotherSizeOtherChannelsAndBadTexelsAreRefused) {
  const ChannelImage right = color_image(bundle_.maps[0]);
  ChannelImage wide = right;
  std::swap(wide.width, wide.height);
  write_exr(camera(0) / "color.exr", wide);
  EXPECT_THAT(refusal(), HasSubstr("8 × 6"));
  ChannelImage grey = right;
  grey.channels.resize(1);
  write_exr(camera(0) / "color.exr", grey);
  EXPECT_THAT(refusal(), HasSubstr("color.exr"));
  write_file_atomically(camera(0) / "color.exr", "no image");
  EXPECT_THAT(refusal(), HasSubstr("color.exr"));
  write_exr(camera(0) / "color.exr", right);
  bundle_.maps[0].confidence[5] = 2;
  write_exr(camera(0) / "micro.exr", micro_image(bundle_.maps[0]));
  EXPECT_THAT(refusal(), HasSubstr("confidence outside 0…1"));
}

TEST_F(EditedBundle, ADamagedManifestIsNotSealedAnew) {
  std::string text = read_text_file(path() / "manifest.json");
  text.replace(text.find("\"small\""), 7, "\"other\"");
  write_file_atomically(path() / "manifest.json", text);
  EXPECT_THAT(refusal(), HasSubstr("its own checksum"));
}

const std::vector<PackPart> kSomeParts = {{0, 100, 1000}, {0, 7, 20}, {0, 50, 50}};

TEST(PackContents, ComeBackWithOffsets) {
  const auto bytes = pack_contents(kSomeParts);
  ASSERT_EQ(bytes.size(), pack_contents_bytes(kSomeParts.size()));
  const auto parts = contents_of_pack(bytes, bytes.size() + 157);
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].offset, bytes.size());
  EXPECT_EQ(parts[2].offset, bytes.size() + 107);
  EXPECT_EQ(parts[1].packed_bytes, 7u);
  EXPECT_EQ(parts[1].bytes, 20u);
}

TEST(PackContents, RefuseWhateverWasChanged) {
  const auto bytes = pack_contents(kSomeParts);
  const std::size_t total = bytes.size() + 157;
  EXPECT_THROW(contents_of_pack(bytes, total + 1), BadDataError);
  for (std::size_t length = 0; length < bytes.size(); ++length)
    EXPECT_THROW(contents_of_pack(std::span(bytes).first(length), total), BadDataError);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    auto changed = bytes;
    changed[bit / 8] ^= std::byte(1u << bit % 8);
    EXPECT_THROW(contents_of_pack(changed, total), BadDataError) << bit;
  }
}

TEST(PackContents, RefuseAPartThatNoStreamInflatesTo) {
  const auto bytes = pack_contents({{0, 10, 4'000'000'000u}, {0, 1, 1}});
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { contents_of_pack(bytes, bytes.size() + 11); }),
              testing::HasSubstr("inflates"));
}

TEST(PackedFrame, ComesBack) {
  const Bundle bundle = small_bundle();
  const Bundle again = unpacked_frame(packed_frame(bundle));
  EXPECT_EQ(again.manifest.name, "small");
  EXPECT_EQ(again.proxy.vertices, bundle.proxy.vertices);
  EXPECT_EQ(again.proxy.faces, bundle.proxy.faces);
  ASSERT_EQ(again.cameras.cameras.size(), 2u);
  EXPECT_EQ(again.cameras.manifold.directions, bundle.cameras.manifold.directions);
  EXPECT_EQ(again.mechanics.mass_kg, bundle.mechanics.mass_kg);
  EXPECT_EQ(again.base.color, bundle.base.color);
  EXPECT_EQ(again.base.seen_by, bundle.base.seen_by);
  for (std::size_t i = 0; i < bundle.base.height_mm.size(); ++i)
    EXPECT_NEAR(again.base.height_mm[i], bundle.base.height_mm[i], 0.5 / 1024);
}

TEST(JsonStructure, RefusesKeysThatAreThereTwice) {
  EXPECT_NO_THROW(parse_json(R"({"a": {"b": 1}, "b": [{"b": 2}, {"b": 3}]})", "d.json"));
  for (const char* text : {R"({"a": 1, "b": 2, "a": 3})", R"([0, {"c": {"a": 1, "a": 1}}])"})
    EXPECT_THROW(parse_json(text, "d.json"), BadDataError) << text;
}

TEST(JsonStructure, RefusesWhatIsNestedTooDeeply) {
  const auto nested = [](std::size_t depth) {
    return std::string(depth, '[') + std::string(depth, ']');
  };
  EXPECT_NO_THROW(parse_json(nested(100), "d.json"));
  for (const std::size_t depth : {101u, 1'000'000u})
    EXPECT_THROW(parse_json(nested(depth), "d.json"), BadDataError) << depth;
}

TEST(JsonStructure, RefusesWhatIsNoJson) {
  for (const char* text : {"", "{", "[1, 2", "{\"a\" 1}", "\xff", "1e999", "1 2"})
    EXPECT_THROW(parse_json(text, "d.json"), BadDataError) << text;
}

// A parser that asked about each value took the square of an array's length: minutes for this one.
TEST(JsonStructure, LongArraysAreReadAtOnce) {
  std::string text = "[{}";
  for (int i = 0; i < 200'000; ++i) text += ",{}";
  EXPECT_EQ(parse_json(text + "]", "long.json").size(), 200'001u);
}

}  // namespace
}  // namespace organbake
