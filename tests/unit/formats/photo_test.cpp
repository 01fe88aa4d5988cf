// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/photo.h"

#include <gmock/gmock.h>
#include <turbojpeg.h>

#include <cstdlib>

#include "file_bytes.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/image/png.h"
#include "pictures/picture_decoders.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

// Smooth, and different in every channel and direction.
Rgb8Image gradient() {
  Rgb8Image image(48, 32);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      std::uint8_t* pixel = image.at(x, y);
      pixel[0] = static_cast<std::uint8_t>(5 * x);
      pixel[1] = static_cast<std::uint8_t>(7 * y);
      pixel[2] = static_cast<std::uint8_t>(2 * x + 3 * y);
    }
  }
  return image;
}

std::string as_jpeg(const Rgb8Image& image, TJSAMP subsampling = TJSAMP_444) {
  tjhandle handle = tjInitCompress();
  unsigned char* bytes = nullptr;
  unsigned long count = 0;
  constexpr int kQuality = 97;
  tjCompress2(handle, image.pixels.data(), image.width, 0, image.height, TJPF_RGB, &bytes, &count,
              subsampling, kQuality, TJFLAG_ACCURATEDCT);
  const std::string jpeg(reinterpret_cast<char*>(bytes), count);
  tjFree(bytes);
  tjDestroy(handle);
  return jpeg;
}

class Photo : public ::testing::Test {
 protected:
  std::string error(const std::string& bytes) {
    write_bytes(file_, bytes);
    return message_of(ExitCode::bad_data, [&] { read_photo(file_); });
  }
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "photo.jpg";
};

TEST_F(Photo, JpegKeepsPixelsInTheirPlaces) {
  const Rgb8Image truth = gradient();
  write_bytes(file_, as_jpeg(truth));
  const Rgb8Image image = read_photo(file_);
  ASSERT_EQ(image.width, truth.width);
  ASSERT_EQ(image.height, truth.height);
  constexpr int kQualityLoss = 4;  // of 255, at quality 97 on a smooth image
  for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
    ASSERT_LE(std::abs(image.pixels[i] - truth.pixels[i]), kQualityLoss);
  }
}

TEST_F(Photo, GreyIsSpreadOverTheChannels) {
  write_bytes(file_, as_jpeg(gradient(), TJSAMP_GRAY));
  const Rgb8Image image = read_photo(file_);
  const std::uint8_t* pixel = image.at(10, 10);
  EXPECT_EQ(pixel[0], pixel[1]);
  EXPECT_EQ(pixel[1], pixel[2]);
}

TEST_F(Photo, TheKindIsToldByContent) {
  write_png(file_, gradient());  // named .jpg
  EXPECT_EQ(read_photo(file_).pixels, gradient().pixels);
}

TEST_F(Photo, MissingFilesAndFoldersAreNoInput) {
  message_of(ExitCode::no_input, [&] { read_photo(folder_.path() / "gone.jpg"); });
  message_of(ExitCode::no_input, [&] { read_photo(folder_.path()); });
}

TEST_F(Photo, OtherFilesAreRefused) {
  EXPECT_THAT(error(""), HasSubstr("neither a PNG nor a JPEG"));
  EXPECT_THAT(error("GIF89a..."), HasSubstr("neither a PNG nor a JPEG"));
  EXPECT_THAT(error("\xFF\xD8\xFF nonsense"), HasSubstr("photo.jpg"));
}

TEST_F(Photo, TruncatedJpegIsRefusedAtEveryLength) {
  const std::string whole = as_jpeg(gradient());
  // The last two bytes are the end marker, which libjpeg can do without.
  for (std::size_t length = 0; length + 2 < whole.size(); length += 5) {
    error(whole.substr(0, length));
  }
}

TEST_F(Photo, TooManyPixelsAreRefusedBeforeTheyAreDecoded) {
  write_bytes(file_, as_jpeg(gradient()));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_jpeg(file_, 100); }),
              HasSubstr("48×32 pixels are more than the limit of 100"));
}

}  // namespace
}  // namespace organbake
