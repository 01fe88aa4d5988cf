// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/photo.h"

#include <array>
#include <fstream>
#include <string_view>

#include "core/error.h"
#include "formats/jpeg.h"
#include "image/png.h"

namespace organbake {

Rgb8Image read_photo(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) {
    throw NoInputError(path, "is a folder, a photograph (PNG or JPEG) is needed");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw NoInputError(path, "cannot be opened");
  std::array<char, 4> first{};
  file.read(first.data(), first.size());
  const std::string_view magic(first.data(), static_cast<std::size_t>(file.gcount()));
  if (magic == "\x89PNG") return read_png(path);
  if (magic.substr(0, 3) == "\xFF\xD8\xFF") return read_jpeg(path);
  throw BadDataError(path, "is neither a PNG nor a JPEG image");
}

}  // namespace organbake
