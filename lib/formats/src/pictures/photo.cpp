// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/photo.h"

#include <string>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/image/png.h"
#include "pictures/picture_decoders.h"

namespace organbake {

namespace {

enum class PictureKind { png, jpeg, exr, other };

PictureKind kind_of(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) {
    throw NoInputError(path, "is a folder, a photograph (PNG or JPEG) is needed");
  }
  const std::string magic = read_beginning(path, 4);
  if (magic == "\x89PNG") return PictureKind::png;
  if (magic.starts_with("\xFF\xD8\xFF")) return PictureKind::jpeg;
  if (magic == "\x76\x2F\x31\x01") return PictureKind::exr;
  return PictureKind::other;
}

void tag(const PictureTags& tags, StoredPicture& picture) {
  picture.turn = tags.turn;
  picture.pixel_aspect = tags.pixel_aspect;
}

}  // namespace

Rgb8Image read_photo(const std::filesystem::path& path) {
  const PictureKind kind = kind_of(path);
  if (kind == PictureKind::png) return read_png(path);
  if (kind == PictureKind::jpeg) return read_jpeg(path);
  throw BadDataError(path, "is neither a PNG nor a JPEG image");
}

StoredPicture read_picture(const std::filesystem::path& path) {
  const PictureKind kind = kind_of(path);
  if (kind == PictureKind::other)
    throw BadDataError(path, "is neither a PNG, a JPEG nor an EXR image");
  const std::vector<std::byte> bytes = read_file(path);
  if (kind == PictureKind::exr) return parse_exr_picture(bytes, path.string());
  StoredPicture picture = kind == PictureKind::png
                              ? parse_png(bytes, path.string())
                              : StoredPicture(parse_jpeg(bytes, path.string()));
  tag(kind == PictureKind::png ? png_tags(bytes) : jpeg_tags(bytes), picture);
  return picture;
}

}  // namespace organbake
