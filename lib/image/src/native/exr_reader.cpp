// SPDX-License-Identifier: Apache-2.0
// Reads OpenEXR: what the header promises (exr_header.cpp) is held against the file's size before
// any memory is taken, common kinds of zip are unpacked by several threads, and the others by the
// library.
#include "organbake/image/exr.h"

#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <libdeflate.h>

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <vector>

#include "exr_header.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/scalar_type.h"

namespace organbake {
namespace {

// Where one channel lies in the lines of an EXR file, and where its values go.
struct ExrPlane {
  bool half = false;            // of two bytes, which become a float; else of four, as they are
  std::size_t line_offset = 0;  // bytes, of its first value in a line
  char* values = nullptr;       // of the whole image: 4 bytes each, row-major; null: not wanted
};

struct ExrLines {
  int width = 0;
  std::size_t line_bytes = 0;
  std::vector<ExrPlane> planes;
};

static_assert(std::endian::native == std::endian::little);

void inflate(std::span<const char> packed, std::span<std::uint8_t> bytes) {
  thread_local const std::unique_ptr<libdeflate_decompressor,
                                     decltype(&libdeflate_free_decompressor)>
      decompressor(libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  if (!decompressor) throw std::bad_alloc();
  // Without a place for the size found, any other than the expected one is an error.
  const libdeflate_result result = libdeflate_zlib_decompress(
      decompressor.get(), packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr);
  if (result != LIBDEFLATE_SUCCESS) throw std::runtime_error("holds a damaged block");
}

// Each byte was stored as its difference to the one before, plus 128. Sums of sixteen at once, by
// adding what lies one, two, four and eight before. Takes the byte before, returns the last one.
std::uint8_t undo_differences(std::span<std::uint8_t> bytes, std::uint8_t last) {
  using Bytes [[gnu::vector_size(16)]] = std::uint8_t;
  using Halves [[gnu::vector_size(16)]] = std::uint64_t;
  constexpr std::size_t kOnce = sizeof(Bytes);
  constexpr Bytes kUpperHalf = Bytes(Halves{0, ~std::uint64_t{0}});
  Bytes before = Bytes{} + last;
  std::size_t i = 0;
  for (; i + kOnce <= bytes.size(); i += kOnce) {
    Bytes sum;
    std::memcpy(&sum, &bytes[i], kOnce);
    sum ^= 128;  // − 128 modulo 256
    for (const int bits : {8, 16, 32}) sum += Bytes(Halves(sum) << bits);
    sum += kUpperHalf &
           __builtin_shufflevector(sum, sum, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7);
    const Bytes here = sum + before;  // what the next sixteen wait for is one addition
    before += __builtin_shufflevector(sum, sum, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15,
                                      15, 15, 15);
    std::memcpy(&bytes[i], &here, kOnce);
  }
  for (last = before[0]; i < bytes.size(); ++i)
    bytes[i] = last = static_cast<std::uint8_t>(last + (bytes[i] ^ 128u));
  return last;
}

// The last byte alone, of those that nobody wants.
std::uint8_t pass_differences(std::span<const std::uint8_t> bytes, std::uint8_t last) {
  for (const std::uint8_t byte : bytes) last = static_cast<std::uint8_t>(last + (byte ^ 128u));
  return last;
}

// The block's even bytes stand in its first half, the odd ones in its second.
void join_bytes(const std::uint8_t* __restrict even, const std::uint8_t* __restrict odd, int count,
                std::uint8_t* __restrict out) {
  for (int k = 0; k < count; ++k) out[2 * k] = even[k], out[2 * k + 1] = odd[k];
}

// As the processor's own conversion would, but for several at once.
void join_halves(const std::uint8_t* __restrict even, const std::uint8_t* __restrict odd, int count,
                 float* __restrict out) {
  for (int k = 0; k < count; ++k) {
    const std::uint32_t half = even[k] | std::uint32_t{odd[k]} << 8;
    const float finite = __builtin_bit_cast(float, (half & 0x7FFF) << 13) * 0x1p112f;
    const std::uint32_t beyond = (half & 0x7C00) == 0x7C00 ? 0x7F800000 : 0;  // infinite, or none
    out[k] = __builtin_bit_cast(
        float, __builtin_bit_cast(std::uint32_t, finite) | beyond | (half & 0x8000) << 16);
  }
}

// Undoes EXR's ZIP and ZIPS compression of one block of lines, as OpenEXR does, in a quarter of the
// time: libdeflate inflates twice as fast as zlib, and the byte predictor goes by sixteen bytes.
// packed: the block's bytes in the file. Throws std::runtime_error for damaged ones.
void unpack_exr_zip(std::span<const char> packed, const ExrLines& lines, int first_row,
                    int row_count) {
  thread_local std::vector<std::uint8_t> scratch;
  scratch.resize(lines.line_bytes * row_count);
  const std::span<std::uint8_t> bytes(scratch);
  const std::size_t half = bytes.size() / 2;  // values have 2 or 4 bytes: even
  if (packed.size() == bytes.size()) {        // did not shrink: stored as it is
    for (std::size_t i = 0; i < half; ++i) {
      bytes[i] = static_cast<std::uint8_t>(packed[2 * i]);
      bytes[half + i] = static_cast<std::uint8_t>(packed[2 * i + 1]);
    }
  } else {
    inflate(packed, bytes);
    std::uint8_t last = 128;  // the first byte has no predecessor, and no bias
    for (std::size_t first = 0; first < bytes.size(); first += lines.line_bytes / 2) {
      for (const ExrPlane& plane : lines.planes) {
        const std::span<std::uint8_t> of_plane = bytes.subspan(
            first + plane.line_offset / 2, std::size_t(lines.width) * (plane.half ? 1 : 2));
        last = plane.values ? undo_differences(of_plane, last) : pass_differences(of_plane, last);
      }
    }
  }
  for (int row = 0; row < row_count; ++row) {
    for (const ExrPlane& plane : lines.planes) {
      if (!plane.values) continue;
      const std::uint8_t* const even = &bytes[(lines.line_bytes * row + plane.line_offset) / 2];
      char* const out = plane.values + std::size_t{4} * lines.width * (first_row + row);
      if (plane.half) {
        join_halves(even, even + half, lines.width, reinterpret_cast<float*>(out));
      } else {
        join_bytes(even, even + half, 2 * lines.width, reinterpret_cast<std::uint8_t*>(out));
      }
    }
  }
}

class MemorySource : public Imf::IStream {
 public:
  MemorySource(std::span<const std::byte> bytes, const std::string& name)
      : Imf::IStream(name.c_str()), bytes_(bytes) {}
  bool read(char* target, int count) override {
    std::memcpy(target, readMemoryMapped(count), static_cast<std::size_t>(count));
    return position_ < bytes_.size();
  }
  // OpenEXR then looks at blocks where they lie. It never writes to them.
  bool isMemoryMapped() const override { return true; }
  char* readMemoryMapped(int count) override {
    if (count < 0 || bytes_.size() - position_ < static_cast<std::size_t>(count))
      throw std::runtime_error("ends early");
    const std::byte* const at = bytes_.data() + position_;
    position_ += count;
    return const_cast<char*>(reinterpret_cast<const char*>(at));
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override {
    if (position > bytes_.size()) throw std::runtime_error("points behind its end");
    position_ = position;
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
};

bool wanted(const std::string& name, const std::vector<std::string>& only) {
  return only.empty() || std::find(only.begin(), only.end(), name) != only.end();
}

// The wanted channels, without their values.
ChannelImage empty_image(const Imf::Header& header, const std::vector<std::string>& only) {
  const Imath::Box2i window = header.dataWindow();
  ChannelImage image;
  image.width = window.max.x - window.min.x + 1;
  image.height = window.max.y - window.min.y + 1;
  const Imf::ChannelList& list = header.channels();
  for (auto it = list.begin(); it != list.end(); ++it) {
    if (!wanted(it.name(), only)) continue;
    Channel channel{it.name(), {}, it.channel().type == Imf::HALF};
    if (it.channel().type == Imf::UINT) {
      channel.values = std::vector<std::uint32_t>(image.pixel_count());
    } else {
      channel.values = std::vector<float>(image.pixel_count());
    }
    image.channels.push_back(std::move(channel));
  }
  return image;
}

char* values_of(Channel& channel) {
  return std::visit([](auto& values) { return reinterpret_cast<char*>(values.data()); },
                    channel.values);
}

// Any compression, by OpenEXR itself.
void read_pixels(Imf::InputFile& file, ChannelImage& image) {
  const Imath::Box2i window = file.header().dataWindow();
  Imf::FrameBuffer frame;
  const std::int64_t first = window.min.x + std::int64_t(window.min.y) * image.width;
  for (Channel& channel : image.channels) {
    const bool whole = std::holds_alternative<std::vector<std::uint32_t>>(channel.values);
    // OpenEXR addresses pixels by window coordinates from a base that may lie before the data.
    frame.insert(channel.name, Imf::Slice(whole ? Imf::UINT : Imf::FLOAT,
                                          values_of(channel) - 4 * first, 4, 4 * image.width));
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
}

ExrLines lines_of(const Imf::Header& header, ChannelImage& image) {
  ExrLines lines;
  lines.width = image.width;
  const Imf::ChannelList& list = header.channels();
  for (auto it = list.begin(); it != list.end(); ++it) {
    const bool half = it.channel().type == Imf::HALF;
    const auto wanted = std::ranges::find(image.channels, it.name(), &Channel::name);
    lines.planes.push_back(
        {half, lines.line_bytes, wanted == image.channels.end() ? nullptr : values_of(*wanted)});
    lines.line_bytes += std::size_t(image.width) * (half ? 2 : 4);
  }
  return lines;
}

// ZIP, the compression of all that is baked.
void read_zip(Imf::InputFile& file, int block_rows, ChannelImage& image) {
  const Imf::Header& header = file.header();
  const ExrLines lines = lines_of(header, image);
  std::vector<std::span<const char>> blocks;
  for (int row = 0; row < image.height; row += block_rows) {
    const char* bytes = nullptr;
    int count = 0;
    file.rawPixelData(header.dataWindow().min.y + row, bytes, count);
    blocks.emplace_back(bytes, static_cast<std::size_t>(count));
  }
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const int row = static_cast<int>(b) * block_rows;
    unpack_exr_zip(blocks[b], lines, row, std::min(block_rows, image.height - row));
  });
}

Eigen::Matrix4d column_vector_matrix(const Imath::M44f& row_vector_matrix) {
  Eigen::Matrix4d m;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) m(i, j) = double(row_vector_matrix[j][i]);
  return m;
}

// The camera as add_camera() of exr_writer.cpp has it; nothing for another's axes.
std::optional<PosedCamera> camera_of(const Imf::Header& header) {
  if (!Imf::hasWorldToCamera(header) || !Imf::hasWorldToNDC(header)) return std::nullopt;
  const Eigen::Matrix4d camera_from_world = column_vector_matrix(Imf::worldToCamera(header));
  const Eigen::Matrix4d ndc =
      column_vector_matrix(Imf::worldToNDC(header)) * camera_from_world.inverse();
  constexpr double kSevenDigits = 1e-4;
  PosedCamera camera;
  camera.camera_from_world = {camera_from_world.topLeftCorner<3, 3>(),
                              camera_from_world.topRightCorner<3, 1>()};
  const Eigen::RowVector4d along(0, 0, 1, 0);
  if (!ndc.allFinite() || !is_rotation(camera_from_world.topLeftCorner<3, 3>(), kSevenDigits) ||
      !ndc.row(3).isApprox(along, kSevenDigits) || !ndc.row(2).isApprox(along, kSevenDigits))
    return std::nullopt;
  const Imath::V2i size = header.dataWindow().size() + Imath::V2i(1);
  Intrinsics& k = camera.intrinsics;
  k.width = size.x;
  k.height = size.y;
  k.fx = ndc(0, 0) * k.width;
  k.cx = ndc(0, 2) * k.width;
  k.fy = ndc(1, 1) * k.height;
  k.cy = ndc(1, 2) * k.height;
  return k.fx > 0 && k.fy > 0 ? std::optional(camera) : std::nullopt;
}

// Calls `read` with the file; whatever OpenEXR throws comes out as BadDataError.
template <class Read>
auto with_exr(std::span<const std::byte> bytes, const std::string& name, std::size_t max_pixels,
              const Read& read) {
  try {
    check_exr_header(bytes, max_pixels);
    MemorySource stream(bytes, name);
    Imf::InputFile file(stream, 0);
    return read(file);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw BadDataError(name + ": is not a readable EXR image: " + error.what());
  }
}

}  // namespace

ChannelImage parse_exr(std::span<const std::byte> bytes, const std::string& name,
                       std::size_t max_pixels, const std::vector<std::string>& only) {
  return with_exr(bytes, name, max_pixels, [&](Imf::InputFile& file) {
    ChannelImage image = empty_image(file.header(), only);
    image.pixel_aspect = double(file.header().pixelAspectRatio());
    const Imf::Compression packed = file.header().compression();
    if (packed == Imf::ZIP_COMPRESSION || packed == Imf::ZIPS_COMPRESSION) {
      read_zip(file, packed == Imf::ZIP_COMPRESSION ? 16 : 1, image);
    } else {
      read_pixels(file, image);
    }
    return image;
  });
}

ExrFacts parse_exr_facts(std::span<const std::byte> bytes, const std::string& name,
                         std::size_t max_pixels) {
  return with_exr(bytes, name, max_pixels, [](Imf::InputFile& file) {
    ExrFacts facts;
    facts.camera = camera_of(file.header());
    for (auto at = file.header().begin(); at != file.header().end(); ++at)
      if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&at.attribute()))
        facts.notes[at.name()] = text->value();
    return facts;
  });
}

ChannelImage read_exr(const std::filesystem::path& path, std::size_t max_pixels) {
  return parse_exr(read_file(path), path.string(), max_pixels);
}

}  // namespace organbake
