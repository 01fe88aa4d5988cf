// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/write_volume.h"

#include <zlib.h>

#include <string>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

// CT noise packs hardly better at higher levels (3 % at 6), in a fifth of the time.
constexpr int kZlibLevel = 1;

std::string header_of(const Volume& volume, std::size_t packed_bytes) {
  std::string matrix, offset, spacing, size;
  for (int axis = 0; axis < 3; ++axis) {
    for (int row = 0; row < 3; ++row) matrix += " " + to_text(volume.direction(row, axis));
    offset += " " + to_text(volume.origin_mm[axis]);
    spacing += " " + to_text(volume.spacing_mm[axis]);
    size += " " + std::to_string(volume.size[axis]);
  }
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
         "CompressedData = True\nCompressedDataSize = " +
         std::to_string(packed_bytes) + "\nTransformMatrix =" + matrix + "\nOffset =" + offset +
         "\nCenterOfRotation = 0 0 0\nElementSpacing =" + spacing + "\nDimSize =" + size +
         "\nElementType = " + (volume.is_real() ? "MET_FLOAT" : "MET_SHORT") +
         "\nElementDataFile = LOCAL\n";
}

}  // namespace

void write_metaimage(const std::filesystem::path& path, const Volume& volume) {
  check_volume(volume, path.string());
  const auto voxels = with_values(volume, [](const auto values) { return std::as_bytes(values); });
  const uLong bytes = static_cast<uLong>(voxels.size());
  std::string packed(compressBound(bytes), '\0');
  uLongf packed_bytes = packed.size();
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &packed_bytes,
                reinterpret_cast<const Bytef*>(voxels.data()), bytes, kZlibLevel) != Z_OK) {
    throw std::bad_alloc();
  }
  packed.resize(packed_bytes);
  write_file_atomically(path, std::string_view(packed.insert(0, header_of(volume, packed_bytes))));
}

}  // namespace organbake
