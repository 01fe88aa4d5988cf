// SPDX-License-Identifier: Apache-2.0
#include "organbake/image/exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/core/temporary_files.h"
#include "support/error_message.h"
#include "support/places.h"
#include "support/testing.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

ChannelImage sample(int width, int height) {
  ChannelImage image{width, height, {}};
  std::vector<float> depth, color;
  std::vector<std::uint32_t> face;
  RandomStream random(4);
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    depth.push_back(i % 3 == 0 ? kInfinity : static_cast<float>(random.uniform(100, 300)));
    color.push_back(static_cast<float>(random.below(2048)) / 2048);  // exact in a half
    face.push_back(i % 5 == 0 ? 0xFFFFFFFFu : static_cast<std::uint32_t>(random.below(80)));
  }
  image.channels = {{"Y", depth, false}, {"R", color, true}, {"face", face, false}};
  return image;
}

struct Values {
  const char* name;
  Imf::PixelType type;
  void* base;
};

void write_by_open_exr(const fs::path& path, std::array<int, 2> size, Imf::Compression compression,
                       const std::vector<Values>& channels) {
  Imf::Header header(size[0], size[1]);
  header.compression() = compression;
  Imf::FrameBuffer frame;
  for (const Values& c : channels) {
    header.channels().insert(c.name, Imf::Channel(c.type));
    frame.insert(c.name,
                 Imf::Slice(c.type, static_cast<char*>(c.base), 4, std::size_t{4} * size[0]));
  }
  Imf::OutputFile output(path.c_str(), header);
  output.setFrameBuffer(frame);
  output.writePixels(size[1]);
}

class Exr : public testing::Test {
 protected:
  TemporaryFolder folder_;
  fs::path at(const char* name) const { return folder_.path() / name; }
  fs::path at_path() const { return at("a.exr"); }
  const std::string kWindow{"dataWindow\0box2i\0", 17},
      kCompression{"compression\0compression\0", 24};
};

TEST_F(Exr, LosslessCompressionsGiveEveryBitBack) {
  const ChannelImage image = sample(37, 21);
  for (const auto c : {ExrCompression::none, ExrCompression::zip, ExrCompression::piz}) {
    write_exr(at("a.exr"), image, {c, 4, {}});
    const ChannelImage back = read_exr(at("a.exr"));
    EXPECT_EQ(back.floats("Y", "a"), image.floats("Y", "a"));
    EXPECT_EQ(back.floats("R", "a"), image.floats("R", "a"));
    EXPECT_EQ(back.uints("face", "a"), image.uints("face", "a"));
    EXPECT_TRUE(back.find("R")->half);
  }
}

// Blocks of all kinds: smooth ones that shrink, noise that does not, a last block cut short, halves
// that are no ordinary numbers; each as OpenEXR itself reads them.
TEST_F(Exr, ZipIsUndoneAsOpenExrDoesIt) {
  constexpr int kWidth = 53, kHeight = 41;
  ChannelImage image{kWidth, kHeight, {}};
  std::vector<float> smooth, odd;
  std::vector<std::uint32_t> noise;
  RandomStream random(11);
  const std::vector<float> special = {0.0f, -0.0f, kInfinity, -kInfinity, 5.9604645e-8f, 65504.0f};
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    smooth.push_back(100 + 0.25f * static_cast<float>(i % kWidth));
    odd.push_back(special[random.below(special.size())]);
    noise.push_back(static_cast<std::uint32_t>(random.below(std::uint64_t{1} << 32)));
  }
  image.channels = {{"Y", smooth, false}, {"R", odd, true}, {"face", noise, false}};
  write_exr(at("a.exr"), image);

  std::vector<float> expected(image.pixel_count());
  Imf::InputFile file(at("a.exr").c_str());
  Imf::FrameBuffer frame;
  frame.insert("R", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(expected.data()), 4,
                               std::size_t{4} * kWidth));
  file.setFrameBuffer(frame);
  file.readPixels(0, kHeight - 1);

  // The same image packed by OpenEXR.
  std::vector<float> smooth_again = smooth;
  std::vector<std::uint32_t> noise_again = noise;
  write_by_open_exr(at("b.exr"), {kWidth, kHeight}, Imf::ZIP_COMPRESSION,
                    {{"Y", Imf::FLOAT, smooth_again.data()},
                     {"face", Imf::UINT, noise_again.data()},
                     {"R", Imf::FLOAT, expected.data()}});
  for (const char* name : {"a.exr", "b.exr"}) {
    const ChannelImage back = read_exr(at(name));
    EXPECT_EQ(back.floats("Y", "a"), smooth);
    EXPECT_EQ(back.uints("face", "a"), noise);
    EXPECT_EQ(back.floats("R", "a"), expected);
  }
}

TEST_F(Exr, EveryLevelHoldsTheSameImageAndHigherOnesAreSmaller) {
  const ChannelImage image = sample(211, 97);
  std::uintmax_t before = 0;
  for (const int level : {12, 6, 1}) {
    write_exr(at("a.exr"), image, {.zip_level = level});
    EXPECT_EQ(read_exr(at("a.exr")).floats("Y", "a"), image.floats("Y", "a"));
    EXPECT_GE(fs::file_size(at("a.exr")), before);
    before = fs::file_size(at("a.exr"));
  }
}

TEST_F(Exr, ReadsTheChannelsThatAreAskedFor) {
  const ChannelImage image = sample(37, 21);
  write_exr(at("a.exr"), image);
  const ChannelImage back = parse_exr(read_file(at("a.exr")), "a.exr", 1 << 16, {"face", "Z"});
  ASSERT_EQ(back.channels.size(), 1u);
  EXPECT_EQ(back.uints("face", "a"), image.uints("face", "a"));
}

TEST_F(Exr, ADamagedBlockIsBadData) {
  write_exr(at("a.exr"), sample(24, 18));
  auto bytes = read_file(at("a.exr"));
  bytes[bytes.size() - 20] ^= std::byte{1};  // within the last block
  EXPECT_THROW(parse_exr(bytes, "a.exr"), BadDataError);
}

TEST_F(Exr, Pxr24KeepsDepthWithinItsPromise) {
  const ChannelImage image = sample(37, 21);
  write_exr(at("a.exr"), image, {ExrCompression::pxr24, 4, {}});
  const ChannelImage back = read_exr(at("a.exr"));
  EXPECT_EQ(back.floats("R", "a"), image.floats("R", "a"));
  constexpr float kPxr24At256Mm = 256.0f / 65536;  // 16 bits of mantissa are kept
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    const float a = image.floats("Y", "a")[i], b = back.floats("Y", "a")[i];
    EXPECT_TRUE(std::isinf(a) ? a == b : std::abs(a - b) <= kPxr24At256Mm) << a << " " << b;
  }
}

// Floats of 24 bits as OpenEXR rounds them, those that are no ordinary numbers, too.
TEST_F(Exr, Pxr24HoldsWhatOpenExrWouldWrite) {
  constexpr int kWidth = 61, kHeight = 37;
  ChannelImage image{kWidth, kHeight, {}};
  RandomStream random(5);
  const auto random_bits = [&] { return static_cast<std::uint32_t>(random.below(1ull << 32)); };
  std::vector<float> floats;
  std::vector<std::uint32_t> numbers;
  const std::vector<std::uint32_t> special = {0x7f800000, 0xff800000, 0x7f800001, 0x7fc00000,
                                              0x7f7fffff, 0xff7fff80, 0x00000080, 0x80000001};
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    const std::uint32_t bits = i % 9 == 0 ? special[random.below(special.size())] : random_bits();
    floats.emplace_back();
    std::memcpy(&floats.back(), &bits, sizeof(bits));
    numbers.push_back(i < image.pixel_count() / 2 ? static_cast<std::uint32_t>(i) : random_bits());
  }
  image.channels = {{"Z", floats, false}, {"face", numbers, false}};
  write_by_open_exr(at("b.exr"), {kWidth, kHeight}, Imf::PXR24_COMPRESSION,
                    {{"Z", Imf::FLOAT, floats.data()}, {"face", Imf::UINT, numbers.data()}});
  const ChannelImage expected = read_exr(at("b.exr"));
  for (const int level : {1, 6}) {
    write_exr(at("a.exr"), image, {ExrCompression::pxr24, level});
    const ChannelImage back = read_exr(at("a.exr"));
    EXPECT_EQ(back.uints("face", "a"), numbers);
    EXPECT_EQ(std::memcmp(back.floats("Z", "a").data(), expected.floats("Z", "a").data(),
                          sizeof(float) * image.pixel_count()),
              0);
  }
}

TEST_F(Exr, CarriesItsCamera) {
  PosedCamera camera{"c", {64, 48, 80, 82, 31, 25}, {}};
  camera.camera_from_world = look_at({100, -200, 50}, {3, 4, 5}, Eigen::Vector3d::UnitZ());
  write_exr(at("a.exr"), sample(64, 48), {ExrCompression::zip, 4, camera});
  const Imf::InputFile file(at("a.exr").c_str());
  const Eigen::Vector3d point(10, 20, 30);
  const Imath::V4f world(10, 20, 30, 1);
  const Imath::V4f in_camera = world * Imf::worldToCamera(file.header());
  const Imath::V4f ndc = world * Imf::worldToNDC(file.header());
  constexpr double kFloatMm = 1e-3;  // float32 at some hundred millimetres, with room
  const Eigen::Vector3d expected = camera.camera_from_world * point;
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(in_camera[k], expected[k], kFloatMm);
  const Eigen::Vector2d pixel = project(camera, point);
  EXPECT_NEAR(ndc.x / ndc.w * 64, pixel.x(), 1e-3);
  EXPECT_NEAR(ndc.y / ndc.w * 48, pixel.y(), 1e-3);
}

TEST_F(Exr, ItsCameraAndNotesComeBack) {
  PosedCamera camera;
  camera.intrinsics = {6, 4, 7.25, 7.5, 3.125, 1.75};
  camera.camera_from_world = look_at({10, -20, 5}, {1, 2, 3}, Eigen::Vector3d::UnitZ());
  const ChannelImage image{6, 4, {{"Z", std::vector<float>(24, 1.0F)}}};
  const std::filesystem::path path = at("noted.exr");
  write_exr(path, image, {.camera = camera, .notes = {{"depthUnit", "relative"}}});
  const ExrFacts facts = parse_exr_facts(read_file(path), "noted.exr");
  ASSERT_TRUE(facts.camera);
  constexpr double kSevenDigits = 1e-5;
  EXPECT_NEAR(facts.camera->intrinsics.fx, 7.25, kSevenDigits);
  EXPECT_NEAR(facts.camera->intrinsics.cy, 1.75, kSevenDigits);
  EXPECT_LT((facts.camera->camera_from_world.rotation - camera.camera_from_world.rotation).norm(),
            kSevenDigits);
  EXPECT_LT((facts.camera->center_world_mm() - camera.center_world_mm()).norm(), 1e-4);
  EXPECT_EQ(facts.notes.at("depthUnit"), "relative");
  write_exr(path, image, {});
  EXPECT_FALSE(parse_exr_facts(read_file(path), "noted.exr").camera);
}

TEST_F(Exr, SameImageSameBytes) {
  write_exr(at("a.exr"), sample(40, 30));
  write_exr(at("b.exr"), sample(40, 30));
  EXPECT_EQ(read_file(at("a.exr")), read_file(at("b.exr")));
}

TEST_F(Exr, AsksForTheRightChannel) {
  const ChannelImage image = sample(4, 4);
  EXPECT_THROW(image.floats("Z", "a.exr"), BadDataError);
  EXPECT_THROW(image.floats("face", "a.exr"), BadDataError);
  EXPECT_THROW(image.uints("Y", "a.exr"), BadDataError);
}

TEST_F(Exr, RefusesWhatIsNoneOrTooLarge) {
  EXPECT_THROW(read_exr(at("missing.exr")), NoInputError);
  write_file_atomically(at("text.exr"), "not a picture");
  EXPECT_THROW(read_exr(at("text.exr")), BadDataError);
  write_exr(at("a.exr"), sample(64, 64));
  EXPECT_THROW(read_exr(at("a.exr"), 64 * 63), BadDataError);
}

// What a header says is looked at before OpenEXR takes memory for it.
TEST_F(Exr, AHeaderThatTheFileCannotBearOutIsRefused) {
  const auto refusal = [&](const std::string& attribute, std::size_t at, std::int32_t number) {
    std::string bytes = read_text_file(at_path());
    // Its name, its type and its size stand before a value.
    const std::size_t value = bytes.find(attribute) + attribute.size() + 4;
    std::memcpy(&bytes[value + at], &number, attribute == kCompression ? 1 : sizeof(number));
    return message_of(ExitCode::bad_data,
                      [&] { parse_exr(std::as_bytes(std::span(bytes)), "a.exr"); });
  };
  write_exr(at_path(), sample(37, 21), {ExrCompression::zip, 4, {}});
  EXPECT_NE(refusal(kWindow, 12, 2'000'000'000).find("claims"), std::string::npos);
  EXPECT_NE(refusal(kWindow, 12, 40'000).find("cannot hold"), std::string::npos);
  EXPECT_NE(refusal(kWindow, 8, 100'000).find("cannot hold"), std::string::npos);
  EXPECT_NE(refusal(kWindow, 8, -2'000'000'000).find("claims"), std::string::npos);
  EXPECT_NE(refusal(kCompression, 0, 1).find("RLE"), std::string::npos);
  EXPECT_NE(refusal(kCompression, 0, 6).find("B44"), std::string::npos);
  EXPECT_NE(refusal(kCompression, 0, 77).find("unknown way"), std::string::npos);
}

TEST_F(Exr, TheSharedDamagedFilesAreRefused) {
  const fs::path folder = shared_data("robustness/exr");
  if (!fs::exists(folder)) GTEST_SKIP() << "no real data at " << folder;
  // All are deep, tiled, damaged, or compressed as nothing here is: what the header tells.
  for (const auto& path : list_files(folder))
    EXPECT_THROW(read_exr(folder / path, 1 << 24), BadDataError) << path;
}

}  // namespace
}  // namespace organbake
