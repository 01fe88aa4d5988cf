// SPDX-License-Identifier: GPL-3.0-or-later
// Stored pixels to Hounsfield units (PS3.3, C.7.6.3 and C.11.1): each slice's rescale, padding to
// air, in parallel. In, slices; out, voxels of 16 bits, or real ones where these do not do.
#include "dicom/dicom.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "dicom/dicom_document.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

// The stored values of one slice, in the machine's byte order.
struct StoredPixels {
  ScalarType type = ScalarType::int16;
  std::vector<std::byte> bytes;
};

DicomCoding checked_coding(const DicomSlice& slice) {
  const DicomPixels& pixels = slice.pixels;
  const DicomCoding coding = coding_of(pixels.transfer_syntax);
  if (coding == DicomCoding::lossy_jpeg)
    throw BadDataError(slice.file, "is stored as lossy JPEG (" + pixels.transfer_syntax +
                                       "), which cannot hold CT values; export it uncompressed or "
                                       "as JPEG 2000");
  if (coding == DicomCoding::unknown)
    throw BadDataError(slice.file, "is stored in transfer syntax \"" + pixels.transfer_syntax +
                                       "\", which is not read; export it uncompressed");
  if (pixels.photometric != "MONOCHROME2" || pixels.samples != 1)
    throw BadDataError(slice.file, "has photometric interpretation \"" + pixels.photometric +
                                       "\"; a CT is MONOCHROME2");
  const bool whole_bytes = pixels.bits_allocated == 8 || pixels.bits_allocated == 16;
  if (!whole_bytes || pixels.bits_stored < 2 || pixels.bits_stored > pixels.bits_allocated)
    throw BadDataError(slice.file, "stores " + std::to_string(pixels.bits_stored) + " of " +
                                       std::to_string(pixels.bits_allocated) +
                                       " bits; 2…16 in 8 or 16 are needed");
  return coding;
}

// Before memory is taken: a lying header must not cost gigabytes.
void check_room(const DicomSlice& slice) {
  constexpr double kStrongestCompression = 2000;  // an empty image as JPEG 2000, with its header
  const double needed = static_cast<double>(slice.columns) * slice.rows *
                        (slice.pixels.bits_allocated / 8) * std::max(1, slice.pixels.frames);
  std::error_code error;
  const double there = slice.pixels.bytes == DicomPixels::kEncapsulated
                           ? kStrongestCompression *
                                 static_cast<double>(std::filesystem::file_size(slice.file, error))
                           : slice.pixels.bytes;
  if (slice.columns < 1 || slice.rows < 1 || needed > there)
    throw BadDataError(slice.file, "truncated: it cannot hold " + std::to_string(slice.columns) +
                                       "×" + std::to_string(slice.rows) + " pixels");
}

// Bits above the stored ones are no part of the value: overlays once lived there.
StoredPixels with_stored_bits(std::vector<std::byte> bytes, const DicomPixels& pixels) {
  const ScalarType type = pixels.bits_allocated == 8
                              ? (pixels.is_signed ? ScalarType::int8 : ScalarType::uint8)
                              : (pixels.is_signed ? ScalarType::int16 : ScalarType::uint16);
  const int spare = pixels.bits_allocated - pixels.bits_stored;
  with_scalar_type(type, [&](auto value) {
    if constexpr (std::is_integral_v<decltype(value)>) {
      for (std::size_t at = 0; at < bytes.size(); at += sizeof value) {
        std::memcpy(&value, &bytes[at], sizeof value);
        value = static_cast<decltype(value)>(static_cast<decltype(value)>(value << spare) >> spare);
        std::memcpy(&bytes[at], &value, sizeof value);
      }
    }
  });
  return {type, std::move(bytes)};
}

StoredPixels read_native(const DicomSlice& slice) {
  const ReadableDicom readable(slice.file);
  std::vector<std::byte> bytes(slice.stored_bytes());
  ByteStream stream(readable.path(), ByteStream::Coding::raw,
                    slice.pixels.offset + bytes.size() * static_cast<std::uint64_t>(slice.frame));
  if (stream.read(bytes) < bytes.size())
    throw BadDataError(slice.file, "truncated: frame " + std::to_string(slice.frame + 1) + " of " +
                                       std::to_string(slice.pixels.frames) + " is missing");
  if (slice.pixels.big_endian && slice.pixels.bits_allocated == 16)
    swap_bytes(bytes.data(), bytes.size() / 2, ScalarType::uint16);
  return with_stored_bits(std::move(bytes), slice.pixels);
}

double padding_hu(const DicomSlice& slice) {
  return slice.slope * slice.pixels.padding->last + slice.intercept;
}

// Some scanners name a padding value that tissue has too (0 HU, say): those would become holes.
bool is_padding_trusted(const DicomSlice& slice) {
  constexpr double kDensestAir_hu = -900;
  return slice.pixels.padding && padding_hu(slice) <= kDensestAir_hu;
}

// Whether the rescaling of a slice's stored values gives whole numbers.
bool is_whole(const DicomSlice& slice) {
  return slice.slope == std::nearbyint(slice.slope) &&
         slice.intercept == std::nearbyint(slice.intercept);
}

// Moves the window of one slice to its place in the volume.
class SliceConversion {
 public:
  SliceConversion(const DicomSlice& slice, StoredPixels stored)
      : slice_(slice),
        stored_(std::move(stored)),
        width_(bytes_of(stored_.type)),
        encoding_{stored_.type, false, slice.slope, slice.intercept},
        padded_(is_padding_trusted(slice)) {}

  // False when a value is no whole number of 16 bits, but the volume has none else.
  bool run(const IndexBox& window, Volume& volume, std::size_t k) const {
    std::size_t to = k * window.size[0] * window.size[1];
    for (int row = window.first[1]; row < window.first[1] + window.size[1]; ++row) {
      const std::size_t from = std::size_t(row) * slice_.columns + window.first[0];
      const auto count = static_cast<std::size_t>(window.size[0]);
      if (!(volume.is_real() ? convert_row(from, count, volume.reals.data() + to)
                             : convert_row(from, count, volume.voxels.data() + to)))
        return false;
      to += count;
    }
    return true;
  }

 private:
  int stored_at(std::size_t i) const {
    return with_scalar_type(stored_.type, [&](auto zero) {
      return static_cast<int>(bytes_as<decltype(zero)>(&stored_.bytes[i * width_]));
    });
  }
  bool is_padding(std::size_t i) const {
    if (!padded_) return false;
    const int value = stored_at(i);
    return value >= slice_.pixels.padding->first && value <= slice_.pixels.padding->last;
  }
  bool convert(std::size_t from, std::size_t count, std::int16_t* to) const {
    return convert_whole(&stored_.bytes[from * width_], count, encoding_, to);
  }
  bool convert(std::size_t from, std::size_t count, float* to) const {
    convert_real(&stored_.bytes[from * width_], count, encoding_, to);
    return true;
  }
  // Runs of padding become air, the runs between them are converted.
  template <typename Value>
  bool convert_row(std::size_t from, std::size_t count, Value* to) const {
    for (std::size_t at = 0; at < count;) {
      const bool air = is_padding(from + at);
      std::size_t end = padded_ ? at + 1 : count;
      while (end < count && is_padding(from + end) == air) ++end;
      if (air) {
        std::fill_n(to + at, end - at, static_cast<Value>(kAir_hu));
      } else if (!convert(from + at, end - at, to + at)) {
        return false;
      }
      at = end;
    }
    return true;
  }

  const DicomSlice& slice_;
  StoredPixels stored_;
  std::size_t width_;
  VoxelEncoding encoding_;
  bool padded_;
};

// False when the volume has whole numbers of 16 bits and the slices others.
bool decode_into(Volume& volume, std::span<const DicomSlice> slices, const IndexBox& window,
                 const RunContext& context) {
  std::atomic<bool> all_fit = true;
  parallel_for(std::size_t{0}, slices.size(), [&](std::size_t k) {
    context.throw_if_cancelled();
    if (!all_fit) return;
    const DicomCoding coding = coding_of(slices[k].pixels.transfer_syntax);
    StoredPixels stored = coding == DicomCoding::native
                              ? read_native(slices[k])
                              : with_stored_bits(decompress(slices[k], coding), slices[k].pixels);
    if (!SliceConversion(slices[k], std::move(stored)).run(window, volume, k)) all_fit = false;
  });
  return all_fit;
}

}  // namespace

void decode_slices(std::span<const DicomSlice> slices, const IndexBox& window, Volume& volume,
                   const RunContext& context, bool real) {
  for (const DicomSlice& slice : slices) {
    checked_coding(slice);
    check_room(slice);
  }
  volume.reals = {};
  volume.voxels.resize(slices.size() * window.size[0] * window.size[1]);
  if (real || !std::all_of(slices.begin(), slices.end(), is_whole)) make_real(volume);
  if (!decode_into(volume, slices, window, context)) {
    make_real(volume);
    decode_into(volume, slices, window, context);
  }
  const DicomSlice& first = slices.front();
  settle_values(volume, first.file.parent_path().string());
  if (first.pixels.padding && !is_padding_trusted(first))
    volume.warnings.push_back("the padding value would be " + to_text(padding_hu(first)) +
                              " HU, which tissue has too; it was left as it is");
}

}  // namespace organbake
