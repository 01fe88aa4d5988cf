// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers in files, as text (in the C locale) and as voxels of any type and byte order. Voxels
// become 16 bits where all are whole numbers of that size, else float32.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "files/volume_files.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 12;
constexpr std::size_t kLongestHeader = std::size_t{1} << 20;
constexpr std::string_view kSeparators = " \t\r\n,()";

template <typename Number>
std::vector<Number> parse(const std::string& text, const std::string& field) {
  std::vector<Number> values;
  std::size_t at = 0;
  while ((at = text.find_first_not_of(kSeparators, at)) != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, at), text.size());
    const std::size_t first = at + (text[at] == '+' ? 1 : 0);
    const auto value = number_in<Number>(std::string_view(text).substr(first, end - first));
    if (!value)
      throw BadDataError(field + " \"" + text.substr(0, 80) + "\" is not a list of numbers");
    values.push_back(*value);
    at = end;
  }
  return values;
}

}  // namespace

HeaderText::HeaderText(const std::filesystem::path& file) : file_(file), stream_(file) {}

bool HeaderText::read_more() {
  const std::size_t before = text_.size();
  text_.resize(std::min(before + kPiece, kLongestHeader));
  const auto room = std::as_writable_bytes(std::span(text_)).subspan(before);
  text_.resize(before + stream_.read(room));
  return text_.size() > before;
}

bool HeaderText::next_line(std::string& line) {
  std::size_t end = text_.find('\n', offset_);
  for (std::size_t looked = text_.size(); end == std::string::npos && read_more();) {
    end = text_.find('\n', looked);
    looked = text_.size();
  }
  if (offset_ >= text_.size()) return false;
  if (end == std::string::npos && text_.size() == kLongestHeader)
    throw BadDataError(file_, "has no end of its header in the first megabyte");
  line = text_.substr(offset_, end == std::string::npos ? end : end - offset_);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  offset_ = end == std::string::npos ? text_.size() : end + 1;
  return true;
}

std::string HeaderFields::get(const std::string& field, const std::string& otherwise) const {
  const auto found = fields_.find(field);
  return found == fields_.end() ? otherwise : found->second;
}

std::int64_t HeaderFields::integer(const std::string& field, std::int64_t otherwise) const {
  return has(field) ? one_integer(get(field), field) : otherwise;
}

std::int64_t HeaderFields::one_integer(const std::string& text, const std::string& field) const {
  const auto values = integers(text, place(field));
  if (values.size() != 1) fail(field + " needs one number");
  return values[0];
}

void HeaderFields::fail(const std::string& message) const { throw BadDataError(path_, message); }

std::vector<double> numbers(const std::string& text, const std::string& field) {
  return parse<double>(text, field);
}

std::vector<std::int64_t> integers(const std::string& text, const std::string& field) {
  return parse<std::int64_t>(text, field);
}

namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;
// Of a value: what float32 keeps of a number that was whole before it was scaled.
constexpr double kWhole = 1e-6;
constexpr float kLargest = 1e30f;  // differences of two stay finite

template <typename Stored>
bool whole_numbers(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                   std::int16_t* out) {
  constexpr double kLowest = std::numeric_limits<std::int16_t>::min();
  constexpr double kHighest = std::numeric_limits<std::int16_t>::max();
  std::size_t whole = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Stored stored;
    std::memcpy(&stored, source + i * sizeof(Stored), sizeof(Stored));
    const double value = encoding.slope * static_cast<double>(stored) + encoding.intercept;
    const double nearest = std::nearbyint(value);
    const bool fits = std::abs(value - nearest) <= kWhole * std::abs(nearest) &&
                      nearest >= kLowest && nearest <= kHighest;
    out[i] = static_cast<std::int16_t>(fits ? nearest : 0);
    whole += fits;
  }
  return whole == count;
}

std::size_t voxels_of(const std::array<int, 3>& size) {
  return static_cast<std::size_t>(size[0]) * size[1] * size[2];
}

void check_room(const ByteStream& stream, std::size_t count, std::size_t bytes_per_voxel) {
  const std::uint64_t needed = static_cast<std::uint64_t>(count) * bytes_per_voxel;
  if (needed <= stream.most_possible_bytes()) return;
  throw BadDataError(stream.file(), "truncated: the header asks for " + std::to_string(needed) +
                                        " bytes of voxels, the file can hold at most " +
                                        std::to_string(stream.most_possible_bytes()));
}

// All 0.
void reset_values(Volume& volume, std::size_t count) {
  volume.reals = {};
  volume.voxels = decltype(volume.voxels)(count);
}

bool all_zero(std::span<const std::byte> bytes) {
  return bytes[0] == std::byte{0} &&
         std::memcmp(bytes.data(), bytes.data() + 1, bytes.size() - 1) == 0;
}

std::string read_all_text(ByteStream& stream, std::size_t most) {
  std::string text;
  std::vector<std::byte> chunk(kBufferBytes);
  for (std::size_t got; (got = stream.read(chunk)) > 0;) {
    text.append(reinterpret_cast<const char*>(chunk.data()), got);
    if (text.size() > most) throw BadDataError(stream.file(), "holds far more text than voxels");
  }
  return text;
}

// Keeps only a box of them and crops the grid to it. What lies before the box's first slice is
// passed over, what lies behind its last is not read.
void decode_box(ByteStream& stream, const VoxelEncoding& encoding, const IndexBox& box,
                Volume& volume) {
  const std::size_t width = bytes_of(encoding.type);
  const auto columns = static_cast<std::size_t>(volume.size[0]);
  const std::size_t slice = columns * static_cast<std::size_t>(volume.size[1]);
  check_room(stream, voxels_of(volume.size), width);
  crop_grid(volume, box);
  reset_values(volume, box.voxels());
  // Of a slice the box's rows are read, of a row everything: whole rows lie together.
  const std::size_t rows = columns * static_cast<std::size_t>(box.size[1]);
  const std::size_t before = columns * static_cast<std::size_t>(box.first[1]);
  std::vector<std::byte> buffer(rows * width);
  std::uint64_t passed = static_cast<std::uint64_t>(box.first[2]) * slice + before;
  std::size_t to = 0;
  for (int k = 0; k < box.size[2]; ++k) {
    stream.skip(passed * width);
    stream.read_exactly(buffer);
    if (encoding.big_endian) swap_bytes(buffer.data(), rows, encoding.type);
    for (int j = 0; j < box.size[1]; ++j) {
      const std::size_t from = static_cast<std::size_t>(j) * columns + box.first[0];
      const auto count = static_cast<std::size_t>(box.size[0]);
      convert_voxels(&buffer[from * width], count, encoding, volume, to);
      to += count;
    }
    passed = slice - rows;
  }
  settle_values(volume, stream.file().string());
}

// Throws BadDataError when voxels' worth of data is left: the header and its data don't belong
// together. A line end or two, which editors and text writers leave, is let pass. Reading to the
// end also makes a decompressor check its sum.
void expect_end(ByteStream& stream) {
  std::array<std::byte, 3> beyond{};
  const std::size_t left = stream.read(beyond);
  const bool line_ends = std::all_of(beyond.begin(), beyond.begin() + left, [](std::byte b) {
    return b == std::byte{'\n'} || b == std::byte{'\r'};
  });
  if (left == beyond.size() || !line_ends)
    throw BadDataError(stream.file(), "holds more data than its header asks for");
}

}  // namespace

bool convert_whole(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                   std::int16_t* out) {
  if (encoding.is_plain_int16()) {
    std::memcpy(out, source, count * sizeof(std::int16_t));
    return true;
  }
  if (encoding.is_plain() && bytes_of(encoding.type) == 1) {
    const bool has_sign = encoding.type == ScalarType::int8;
    for (std::size_t i = 0; i < count; ++i) {
      const auto byte = std::to_integer<std::uint8_t>(source[i]);
      out[i] = has_sign ? static_cast<std::int8_t>(byte) : byte;
    }
    return true;
  }
  return with_scalar_type(encoding.type, [&](auto zero) {
    return whole_numbers<decltype(zero)>(source, count, encoding, out);
  });
}

void convert_real(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                  float* out) {
  with_scalar_type(encoding.type, [&](auto stored) {
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(&stored, source + i * sizeof stored, sizeof stored);
      const double value = encoding.slope * static_cast<double>(stored) + encoding.intercept;
      constexpr double kMost = std::numeric_limits<float>::max();
      out[i] = static_cast<float>(std::clamp(value, -kMost, kMost));
    }
  });
}

void convert_voxels(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                    Volume& volume, std::size_t first) {
  if (!volume.is_real()) {
    if (convert_whole(source, count, encoding, volume.voxels.data() + first)) return;
    make_real(volume);
  }
  convert_real(source, count, encoding, volume.reals.data() + first);
}

void settle_values(Volume& volume, const std::string& name) {
  std::size_t not_numbers = 0, beyond = 0;
  for (float& value : volume.reals) {
    not_numbers += std::isnan(value);
    beyond += std::abs(value) > kLargest;
    value = std::clamp(value, -kLargest, kLargest);
  }
  const auto tell = [&](std::size_t part, const char* what) {
    if (part == 0) return;
    volume.warnings.push_back(std::to_string(part) + " of " + std::to_string(volume.voxel_count()) +
                              " voxels are " + what);
  };
  if (volume.is_real() && not_numbers == volume.voxel_count())
    throw BadDataError(name + ": every voxel is NaN");
  tell(not_numbers, "NaN; they count as outside");
  tell(beyond, "infinite or beyond ±1e30; they count as that");
}

void set_values(Volume& volume, std::span<const double> values) {
  reset_values(volume, values.size());
  const std::span<const std::byte> bytes = std::as_bytes(values);
  convert_voxels(bytes.data(), values.size(), {ScalarType::float64, false, 1, 0}, volume, 0);
  settle_values(volume, "the volume");
}

void decode_voxels(ByteStream& stream, const VoxelEncoding& encoding, Volume& volume) {
  const std::size_t count = voxels_of(volume.size), width = bytes_of(encoding.type);
  check_room(stream, count, width);
  reset_values(volume, count);
  const std::size_t at_once = kBufferBytes / width, pieces = (count + at_once - 1) / at_once;
  const auto decode = [&](std::size_t first_piece, std::size_t last_piece, const auto& read) {
    std::vector<std::byte> buffer(kBufferBytes);
    for (std::size_t p = first_piece; p < last_piece; ++p) {
      const std::size_t first = p * at_once, some = std::min(at_once, count - first);
      const std::span<std::byte> bytes = std::span(buffer).first(some * width);
      read(first * width, bytes);
      // A mask's background stays where nobody has written.
      if (encoding.intercept == 0 && all_zero(bytes)) continue;
      if (encoding.big_endian) swap_bytes(buffer.data(), some, encoding.type);
      convert_voxels(buffer.data(), some, encoding, volume, first);
    }
  };
  if (stream.reads_ahead() && encoding.is_surely_whole()) {
    // New memory costs more time than what is copied to it.
    constexpr std::size_t kGrain = 8;
    parallel_pieces(std::size_t{0}, pieces, kGrain, [&](std::size_t first, std::size_t last) {
      decode(first, last, [&](std::size_t at, auto bytes) { stream.read_ahead(at, bytes); });
    });
    stream.skip(count * width);
  } else {
    decode(0, pieces, [&](std::size_t, auto bytes) { stream.read_exactly(bytes); });
  }
  settle_values(volume, stream.file().string());
}

void decode_text_voxels(ByteStream& stream, const VoxelEncoding& encoding, Volume& volume) {
  const std::size_t count = voxels_of(volume.size);
  constexpr std::size_t kShortestNumber = 2, kLongestNumber = 64;  // with the space behind it
  check_room(stream, count > 0 ? count - 1 : 0, kShortestNumber);
  const std::string text = read_all_text(stream, count * kLongestNumber + kBufferBytes);
  reset_values(volume, count);
  VoxelEncoding as_double = encoding;
  as_double.type = ScalarType::float64;
  const char *at = text.data(), *end = at + text.size();
  const auto skip_space = [&] {
    while (at < end && std::strchr(" \t\r\n,", *at)) ++at;
  };
  for (std::size_t i = 0; i < count; ++i) {
    skip_space();
    double value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc() || next == at)
      throw BadDataError(stream.file(), "value " + std::to_string(i + 1) + " of " +
                                            std::to_string(count) + " is missing or no number");
    at = next;
    convert_voxels(reinterpret_cast<const std::byte*>(&value), 1, as_double, volume, i);
  }
  skip_space();
  if (at != end) throw BadDataError(stream.file(), "holds more values than its header asks for");
  settle_values(volume, stream.file().string());
}

Volume decode_region(ByteStream stream, const VoxelLayout& layout, const VolumeReadOptions& options,
                     const Shear& shear, const std::string& name, Volume grid) {
  if (options.grid_only && !shear) return grid;
  const bool crop = options.region && !shear;
  const IndexBox box = crop ? voxels_of_region(grid, *options.region, name) : IndexBox::whole(grid);
  if (layout.is_text) {
    if (layout.times > 1) throw BadDataError(name + ": holds several volumes as text; save it raw");
    decode_text_voxels(stream, layout.encoding, grid);
    grid = cropped(std::move(grid), box);
    return straightened(std::move(grid), shear, options, name);
  }
  const std::size_t width = bytes_of(layout.encoding.type);
  if (layout.interleaved) {
    stream = every_nth_value(std::move(stream), width, static_cast<std::size_t>(layout.times),
                             static_cast<std::size_t>(layout.time));
  } else {
    stream.skip(static_cast<std::uint64_t>(layout.time) * voxels_of(grid.size) * width);
  }
  const bool is_last = layout.interleaved || layout.time + 1 == layout.times;
  if (crop) {
    decode_box(stream, layout.encoding, box, grid);
    return grid;
  }
  decode_voxels(stream, layout.encoding, grid);
  if (layout.may_go_on) {
    // Reading past the voxels makes the decompressor check its sum over all that came before.
    std::byte beyond;
    if (is_last) stream.read({&beyond, 1});
  } else if (is_last) {
    expect_end(stream);
  }
  return straightened(std::move(grid), shear, options, name);
}

}  // namespace organbake
