// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "files/byte_stream.h"
#include "grid/sheared_grid.h"
#include "organbake/core/scalar_type.h"
#include "organbake/volume/read_options.h"
#include "organbake/volume/region.h"
#include "organbake/volume/volume.h"

namespace organbake {

// How stored values become Hounsfield units (or labels): value = slope · stored + intercept.
struct VoxelEncoding {
  ScalarType type = ScalarType::int16;
  bool big_endian = false;
  double slope = 1;
  double intercept = 0;

  bool is_plain() const { return slope == 1 && intercept == 0; }
  bool is_plain_int16() const { return type == ScalarType::int16 && is_plain(); }
  // Whatever is stored is a whole number of 16 bits.
  bool is_surely_whole() const {
    return is_plain() && (type == ScalarType::int16 || bytes_of(type) == 1);
  }
};

// Converts `count` values in the machine's byte order to whole numbers of 16 bits; false when one
// of them is none, and then `out` means nothing.
bool convert_whole(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                   std::int16_t* out);
// The same to float32.
void convert_real(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                  float* out);
// Converts them into the volume's values from index `first` on. The volume has its values already,
// and becomes real with the first one that is no whole number of 16 bits.
void convert_voxels(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                    Volume& volume, std::size_t first);

// Tells of values that are NaN through the warnings; infinite ones become the largest numbers that
// can be reckoned with. Throws BadDataError when no voxel is a number.
void settle_values(Volume& volume, const std::string& name);

// Reads volume.size's voxels from the stream through small buffers, by all threads where the file
// lets them; where all of one is 0 nothing is written, and a mask's background takes no memory.
// Throws BadDataError when the data is too short (before memory is taken, where the file's size
// shows it).
void decode_voxels(ByteStream& stream, const VoxelEncoding& encoding, Volume& volume);
// Keeps only a box of them and crops the grid to it. What lies before the box's first slice is
// passed over, what lies behind its last is not read.
void decode_box(ByteStream& stream, const VoxelEncoding& encoding, const IndexBox& box,
                Volume& volume);
// The same from whitespace-separated decimal text.
void decode_text_voxels(ByteStream& stream, const VoxelEncoding& encoding, Volume& volume);

// Throws BadDataError when voxels' worth of data is left: the header and its data don't belong
// together. A line end or two, which editors and text writers leave, is let pass. Reading to the
// end also makes a decompressor check its sum.
void expect_end(ByteStream& stream);

// How the voxels of one volume lie in a file of one or several: behind others, or between them.
struct VoxelLayout {
  VoxelEncoding encoding;
  bool is_text = false;
  std::int64_t time = 0, times = 1;  // this volume of so many
  bool interleaved = false;          // the volumes' values stand side by side, voxel by voxel
};

// The whole of what a header announced, text or binary, or the part of it that options.region
// wants, and nothing behind it, straightened where its grid is sheared. `grid` has its place
// already; `name` is for errors.
Volume decode_region(ByteStream stream, const VoxelLayout& layout, const VolumeReadOptions& options,
                     const Shear& shear, const std::string& name, Volume grid);

}  // namespace organbake
