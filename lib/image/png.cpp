// SPDX-License-Identifier: Apache-2.0
#include "image/png.h"

#include <png.h>

#include <cstring>
#include <optional>

#include "core/error.h"
#include "core/files.h"

namespace organbake {
namespace {

// libpng's simplified interface reports by value: no longjmp crosses our frames.
struct ReadState : png_image {
  ReadState() : png_image{} { version = PNG_IMAGE_VERSION; }
  ~ReadState() { png_image_free(this); }
};

// libpng's writer calls back with chunks; errors come through the classic interface's longjmp, so
// nothing with a destructor lives between setjmp and the calls.
struct PngWriter {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string bytes;
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
};

void append_bytes(png_structp png, png_bytep data, png_size_t count) {
  static_cast<PngWriter*>(png_get_io_ptr(png))->bytes.append(reinterpret_cast<char*>(data), count);
}

void ignore_flush(png_structp) {}

bool encode(PngWriter& writer, const Rgb8Image& image, int level) {
  if (setjmp(png_jmpbuf(writer.png)) != 0) return false;
  png_set_write_fn(writer.png, &writer, append_bytes, ignore_flush);
  png_set_compression_level(writer.png, level);
  if (level <= 2) png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_IHDR(writer.png, writer.info, image.width, image.height, 8, PNG_COLOR_TYPE_RGB,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB_gAMA_and_cHRM(writer.png, writer.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_write_info(writer.png, writer.info);
  for (int y = 0; y < image.height; ++y) png_write_row(writer.png, image.at(0, y));
  png_write_end(writer.png, writer.info);
  return true;
}

// Nothing when libpng refuses the image, an empty one perhaps.
std::optional<std::string> encoded(const Rgb8Image& image, int level) {
  PngWriter writer;
  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  writer.info = writer.png ? png_create_info_struct(writer.png) : nullptr;
  if (!writer.info || !encode(writer, image, level)) return std::nullopt;
  return std::move(writer.bytes);
}

std::string no_png_of(const Rgb8Image& image) {
  return "libpng cannot encode an image of " + std::to_string(image.width) + " × " +
         std::to_string(image.height) + " pixels";
}

}  // namespace

Rgb8Image read_png(const std::filesystem::path& path, std::size_t max_pixels) {
  const std::vector<std::byte> bytes = read_file(path);
  ReadState state;
  const auto fail = [&] {
    throw BadDataError(path, std::string("is not a readable PNG: ") + state.message);
  };
  if (!png_image_begin_read_from_memory(&state, bytes.data(), bytes.size())) fail();
  if (state.height == 0 || state.width > max_pixels / state.height) {
    throw BadDataError(path, "claims " + std::to_string(state.width) + " × " +
                                 std::to_string(state.height) + " pixels");
  }
  // Kept as the file encodes it; alpha is dropped over black by the simplified reader's colour map.
  state.format = PNG_FORMAT_RGB;
  Rgb8Image image(static_cast<int>(state.width), static_cast<int>(state.height));
  const png_color black = {0, 0, 0};
  if (!png_image_finish_read(&state, &black, image.pixels.data(), 0, nullptr)) fail();
  return image;
}

std::string encode_png(const Rgb8Image& image, int compression_level) {
  if (auto bytes = encoded(image, compression_level)) return *std::move(bytes);
  throw Error(ExitCode::internal, no_png_of(image));
}

void write_png(const std::filesystem::path& path, const Rgb8Image& image, int compression_level) {
  const auto bytes = encoded(image, compression_level);
  if (!bytes) throw IoError::writing(path, no_png_of(image));
  write_file_atomically(path, *bytes);
}

}  // namespace organbake
