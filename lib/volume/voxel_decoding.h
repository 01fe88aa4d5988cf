// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/scalar_type.h"
#include "volume/byte_stream.h"
#include "volume/read_options.h"
#include "volume/region.h"
#include "volume/sheared_grid.h"
#include "volume/volume.h"

namespace organbake {

// How stored values become Hounsfield units (or labels): value = slope · stored + intercept.
struct VoxelEncoding {
  ScalarType type = ScalarType::int16;
  bool big_endian = false;
  double slope = 1;
  double intercept = 0;

  bool is_plain_int16() const { return type == ScalarType::int16 && slope == 1 && intercept == 0; }
};

// What was lost on the way to int16.
struct ConversionLoss {
  struct Run {
    std::size_t first, count;  // voxels
  };
  std::size_t rounded = 0;  // off by more than a thousandth
  std::size_t clamped = 0;  // beyond int16
  std::vector<Run> not_numbers;

  void add(const ConversionLoss& other);
};

// Converts `count` values in the machine's byte order into volume.voxels from index `first` on.
void convert_voxels(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                    Volume& volume, std::size_t first, ConversionLoss& loss);

// Gives NaN voxels the volume's lowest value and tells the user of all losses through `warnings`.
// Throws BadDataError when no voxel is a number.
void settle_losses(const ConversionLoss& loss, Volume& volume, const std::string& name);

// Reads volume.size's voxels from the stream; int16 goes straight to its place, everything else
// through a small buffer. Throws BadDataError when the data is too short (before memory is taken,
// where the file's size shows it).
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
