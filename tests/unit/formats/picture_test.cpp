// SPDX-License-Identifier: GPL-3.0-or-later
// Every pixel type that cameras and programs write gives the radiance that was put into it.

#include <png.h>
#include <turbojpeg.h>

#include "organbake/core/temporary_files.h"
#include "organbake/formats/photo.h"
#include "organbake/image/exr.h"
#include "organbake/image/png.h"
#include "organbake/image/srgb.h"
#include "support/files.h"
#include "support/testing.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 40, kHeight = 16;

// Linear light of the test picture: a red gradient that is nowhere black.
float radiance(int x, int y, int channel) {
  const float tint[3] = {0.9F, 0.5F, 0.4F};
  return tint[channel] * (0.1F + 0.9F * float(x) / kWidth) * (1 - 0.3F * float(y) / kHeight);
}
float grey(int x, int y) { return radiance(x, y, 0); }

struct PngKind {
  int color_type, bits;
  std::uint32_t across = 0, down = 0;  // pixels per length, of pHYs
  int orientation = 0;                 // of eXIf
};

void put(std::string& row, double share, int bits) {
  const auto value = std::lround(share * (bits == 16 ? 65535 : 255));
  if (bits == 16) row += static_cast<char>(value >> 8);
  row += static_cast<char>(value & 255);
}

// libpng's classic interface: rows of samples as the file has them.
void write_kind(const std::filesystem::path& path, const PngKind& kind) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, kWidth, kHeight, kind.bits, kind.color_type, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_color palette[256];
  for (int i = 0; i < 256; ++i)
    palette[i] = {static_cast<png_byte>(i), static_cast<png_byte>(i), static_cast<png_byte>(i)};
  if (kind.color_type == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, palette, 256);
  if (kind.across > 0) png_set_pHYs(png, info, kind.across, kind.down, PNG_RESOLUTION_UNKNOWN);
  png_byte exif[] = {'M', 'M',  0, 42, 0, 0, 0, 8, 0, 1,
                     1,   0x12, 0, 3,  0, 0, 0, 1, 0, static_cast<png_byte>(kind.orientation),
                     0,   0};
  if (kind.orientation > 0) png_set_eXIf_1(png, info, sizeof exif, exif);
  png_write_info(png, info);
  const bool color =
      (kind.color_type & PNG_COLOR_MASK_COLOR) && kind.color_type != PNG_COLOR_TYPE_PALETTE;
  for (int y = 0; y < kHeight; ++y) {
    std::string row;
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < (color ? 3 : 1); ++c)
        put(row, srgb_from_linear(color ? radiance(x, y, c) : grey(x, y)), kind.bits);
      if (kind.color_type & PNG_COLOR_MASK_ALPHA) put(row, 0.5, kind.bits);
    }
    png_write_row(png, reinterpret_cast<png_const_bytep>(row.data()));
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
}

// The largest relative error of the radiance, over all pixels and channels.
double radiance_error(const StoredPicture& picture, bool color) {
  EXPECT_EQ(picture.color.width, kWidth);
  EXPECT_EQ(picture.color.height, kHeight);
  double worst = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) {
        const std::size_t k = 3 * (std::size_t(y) * kWidth + x) + c;
        const float truth = color ? radiance(x, y, c) : grey(x, y);
        const float read = picture.linear.empty() ? linear_from_srgb8()[picture.color.pixels[k]]
                                                  : picture.linear[k];
        worst = std::max(worst, std::abs(double(read) / truth - 1));
      }
  return worst;
}

class PictureFile : public ::testing::Test {
 protected:
  StoredPicture of(const PngKind& kind) {
    write_kind(file_, kind);
    return read_picture(file_);
  }
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "frame";
};

TEST_F(PictureFile, EveryPngKindGivesItsRadiance) {
  constexpr double kHalfALevel = 0.03;   // of 8 bits, at the darkest value here
  constexpr double kSixteenBits = 2e-4;  // the same of 16
  for (int bits : {8, 16})
    for (int type : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                     PNG_COLOR_TYPE_RGB_ALPHA, PNG_COLOR_TYPE_PALETTE}) {
      if (type == PNG_COLOR_TYPE_PALETTE && bits == 16) continue;
      const StoredPicture picture = of({type, bits});
      const bool color = type == PNG_COLOR_TYPE_RGB || type == PNG_COLOR_TYPE_RGB_ALPHA;
      EXPECT_EQ(picture.linear.empty(), bits == 8);
      EXPECT_LT(radiance_error(picture, color), bits == 8 ? kHalfALevel : kSixteenBits)
          << "type " << type << ", " << bits << " bits";
    }
}

TEST_F(PictureFile, PhotographsOf16BitsAreAsTheir8BitCopies) {
  write_kind(file_, {PNG_COLOR_TYPE_RGB, 8});
  const Rgb8Image shallow = read_photo(file_);
  write_kind(file_, {PNG_COLOR_TYPE_RGB, 16});
  const Rgb8Image deep = read_photo(file_);
  for (std::size_t i = 0; i < deep.pixels.size(); ++i)
    ASSERT_NEAR(int(deep.pixels[i]), int(shallow.pixels[i]), 1);
}

ChannelImage exr_of(const std::vector<std::string>& names, float gain, float alpha, bool half) {
  ChannelImage image{kWidth, kHeight, {}};
  for (const std::string& name : names) {
    std::vector<float> values;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const int c = name == "G" ? 1 : name == "B" ? 2 : 0;
        values.push_back(name == "A" ? alpha : gain * alpha * radiance(x, y, c));
      }
    image.channels.push_back({name, values, half});
  }
  return image;
}

TEST_F(PictureFile, ExrIsLinear) {
  constexpr double kHalfFloat = 1e-3, kFloat = 1e-6;
  for (bool half : {false, true}) {
    write_exr(file_, exr_of({"B", "G", "R"}, 1, 1, half));
    EXPECT_LT(radiance_error(read_picture(file_), true), half ? kHalfFloat : kFloat);
  }
  write_exr(file_, exr_of({"A", "B", "G", "R"}, 1, 0.25F, false));
  EXPECT_LT(radiance_error(read_picture(file_), true), kFloat) << "freed from its alpha";
  write_exr(file_, exr_of({"Y"}, 1, 1, false));
  EXPECT_LT(radiance_error(read_picture(file_), false), kFloat);
  write_exr(file_, exr_of({"Y", "Z"}, 1, 1, false));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_picture(file_); }), HasSubstr("depth map"));
  write_exr(file_, exr_of({"N"}, 1, 1, false));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_picture(file_); }), HasSubstr("R, G, B"));
}

TEST_F(PictureFile, ExrOfAnyExposureIsToBeLookedAt) {
  for (float gain : {1e-3F, 1.F, 300.F}) {
    write_exr(file_, exr_of({"B", "G", "R"}, gain, 1, false));
    const StoredPicture picture = read_picture(file_);
    const auto most = *std::max_element(picture.color.pixels.begin(), picture.color.pixels.end());
    EXPECT_GT(most, 200) << gain;
    EXPECT_LT(most, 255) << gain;
  }
}

TEST_F(PictureFile, PngTellsAspectAndTurn) {
  EXPECT_EQ(of({PNG_COLOR_TYPE_RGB, 8}).pixel_aspect, 1);
  EXPECT_EQ(of({PNG_COLOR_TYPE_RGB, 8, 1, 2}).pixel_aspect, 2);
  for (int turn = 1; turn <= 8; ++turn)
    EXPECT_EQ(of({PNG_COLOR_TYPE_RGB, 8, 0, 0, turn}).turn, static_cast<Turn>(turn));
  EXPECT_EQ(of({PNG_COLOR_TYPE_RGB, 8, 0, 0, 77}).turn, Turn::none);
}

std::string jpeg_with(int orientation, int across, int down, bool little) {
  const std::vector<unsigned char> pixels(3 * kWidth * kHeight, 90);
  tjhandle handle = tjInitCompress();
  unsigned char* bytes = nullptr;
  unsigned long count = 0;
  tjCompress2(handle, pixels.data(), kWidth, 0, kHeight, TJPF_RGB, &bytes, &count, TJSAMP_444, 95,
              0);
  std::string jpeg(reinterpret_cast<char*>(bytes), count);
  tjFree(bytes);
  tjDestroy(handle);
  jpeg[14] = static_cast<char>(across >> 8), jpeg[15] = static_cast<char>(across & 255);
  jpeg[16] = static_cast<char>(down >> 8), jpeg[17] = static_cast<char>(down & 255);
  std::string tiff(26, '\0');
  const auto number = [&](std::size_t at, int size, int value) {
    for (int i = 0; i < size; ++i)
      tiff[at + static_cast<std::size_t>(little ? i : size - 1 - i)] =
          static_cast<char>(value >> 8 * i & 255);
  };
  tiff[0] = tiff[1] = little ? 'I' : 'M';
  number(2, 2, 42);
  number(4, 4, 8);
  number(8, 2, 1);
  number(10, 2, 0x0112);
  number(12, 2, 3);
  number(14, 4, 1);
  number(18, 2, orientation);
  std::string exif = std::string("\xFF\xE1\0", 3) + static_cast<char>(2 + 6 + tiff.size());
  exif += std::string("Exif\0\0", 6) + tiff;
  return jpeg.substr(0, 20) + exif + jpeg.substr(20);
}

TEST_F(PictureFile, JpegTellsAspectAndTurn) {
  for (int turn = 1; turn <= 8; ++turn)
    for (bool little : {false, true}) {
      write_bytes(file_, jpeg_with(turn, 1, 2, little));
      const StoredPicture picture = read_picture(file_);
      EXPECT_EQ(picture.turn, static_cast<Turn>(turn));
      EXPECT_EQ(picture.pixel_aspect, 2);
    }
  write_bytes(file_, jpeg_with(9, 0, 300, true));
  EXPECT_EQ(read_picture(file_).turn, Turn::none);
  EXPECT_EQ(read_picture(file_).pixel_aspect, 1);
}

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
  for (std::size_t i = 0; i < truth.pixels.size(); ++i)
    ASSERT_LE(std::abs(image.pixels[i] - truth.pixels[i]), kQualityLoss);
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
  for (std::size_t length = 0; length + 2 < whole.size(); length += 5)
    error(whole.substr(0, length));
}

TEST_F(Photo, TooManyPixelsAreRefusedBeforeTheyAreDecoded) {
  std::string jpeg = as_jpeg(gradient());
  const std::size_t frame = jpeg.find("\xFF\xC0");  // its height and width follow five bytes on
  ASSERT_NE(frame, jpeg.npos);
  jpeg.replace(frame + 5, 4, "\xFF\xDC\xFF\xDC");
  EXPECT_THAT(error(jpeg), HasSubstr("65500×65500 pixels are more than the limit of"));
}

}  // namespace
}  // namespace organbake
