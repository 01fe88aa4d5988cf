// SPDX-License-Identifier: Apache-2.0
#include "organbake/image/exr_writer.h"

#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfVersion.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "exr_packer.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

// OpenEXR writes here, and the finished bytes go to disk in one atomic step.
class MemorySink : public Imf::OStream {
 public:
  MemorySink() : Imf::OStream("memory") {}
  void write(const char* bytes, int count) override {
    if (bytes_.size() < position_ + count) bytes_.resize(position_ + count);
    std::memcpy(bytes_.data() + position_, bytes, count);
    position_ += count;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::size_t position_ = 0;
};

Imf::Compression imf_compression(ExrCompression compression) {
  switch (compression) {
    case ExrCompression::none:
      return Imf::NO_COMPRESSION;
    case ExrCompression::zip:
      return Imf::ZIP_COMPRESSION;
    case ExrCompression::piz:
      return Imf::PIZ_COMPRESSION;
    case ExrCompression::pxr24:
      return Imf::PXR24_COMPRESSION;
    case ExrCompression::dwaa:
      return Imf::DWAA_COMPRESSION;
  }
  return Imf::ZIP_COMPRESSION;
}

// Imath multiplies row vectors from the left: rows here are the images of the world's axes.
Imath::M44f row_vector_matrix(const Eigen::Matrix4d& column_vector_matrix) {
  Imath::M44f m;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) m[i][j] = static_cast<float>(column_vector_matrix(j, i));
  }
  return m;
}

// worldToNDC ends in 0…1 over the image, x right and y down, after the division by w = z.
void add_camera(Imf::Header& header, const PosedCamera& camera) {
  Eigen::Matrix4d camera_from_world = Eigen::Matrix4d::Identity();
  camera_from_world.topLeftCorner<3, 3>() = camera.camera_from_world.rotation;
  camera_from_world.topRightCorner<3, 1>() = camera.camera_from_world.translation;
  const Intrinsics& k = camera.intrinsics;
  Eigen::Matrix4d ndc_from_camera = Eigen::Matrix4d::Zero();
  ndc_from_camera(0, 0) = k.fx / k.width;
  ndc_from_camera(0, 2) = k.cx / k.width;
  ndc_from_camera(1, 1) = k.fy / k.height;
  ndc_from_camera(1, 2) = k.cy / k.height;
  ndc_from_camera(2, 2) = 1;
  ndc_from_camera(3, 2) = 1;
  Imf::addWorldToCamera(header, row_vector_matrix(camera_from_world));
  Imf::addWorldToNDC(header, row_vector_matrix(ndc_from_camera * camera_from_world));
}

// Points OpenEXR at a channel's memory; halves are converted into `halves`, which keeps them alive.
Imf::Slice slice_of(const Channel& channel, int width, std::deque<std::vector<half>>& halves) {
  const char* base = nullptr;
  std::size_t size = sizeof(float);
  Imf::PixelType type = Imf::FLOAT;
  if (const auto* uints = std::get_if<std::vector<std::uint32_t>>(&channel.values)) {
    base = reinterpret_cast<const char*>(uints->data());
    type = Imf::UINT;
  } else if (channel.half) {
    const auto& floats = channel.floats();
    halves.emplace_back(floats.begin(), floats.end());
    base = reinterpret_cast<const char*>(halves.back().data());
    size = sizeof(half);
    type = Imf::HALF;
  } else {
    base = reinterpret_cast<const char*>(channel.floats().data());
  }
  return {type, const_cast<char*>(base), size, size * width};
}

template <class Value>
void put(MemorySink& stream, Value value) {
  char bytes[sizeof(Value)];
  std::memcpy(bytes, &value, sizeof(Value));
  stream.write(bytes, sizeof(Value));
}

// The lines of a block as the file has them: line by line, in each the channels by name.
void gather(const Imf::FrameBuffer& frame, int width, int first_row, int row_count,
            std::vector<char>& lines) {
  lines.clear();
  for (int row = first_row; row < first_row + row_count; ++row) {
    for (auto it = frame.begin(); it != frame.end(); ++it) {
      const Imf::Slice& slice = it.slice();
      const char* const from = slice.base + slice.yStride * static_cast<std::size_t>(row);
      lines.insert(lines.end(), from, from + slice.xStride * static_cast<std::size_t>(width));
    }
  }
}

// OpenEXR's own writer, but for the packing: a scan-line file is its header, a table of where the
// blocks of 16 lines begin, and the blocks.
void write_packed(MemorySink& stream, const Imf::Header& header, const Imf::FrameBuffer& frame,
                  ExrPacker packer) {
  constexpr int kVersion = 2, kBlockRows = 16;
  header.sanityCheck();
  const Imath::V2i size = header.dataWindow().size() + Imath::V2i(1);
  put<std::int32_t>(stream, Imf::MAGIC);
  put<std::int32_t>(stream, kVersion);
  header.writeTo(stream);
  const std::uint64_t table = stream.tellp();
  const int blocks = (size.y + kBlockRows - 1) / kBlockRows;
  for (int b = 0; b < blocks; ++b) put<std::uint64_t>(stream, 0);
  std::vector<Imf::PixelType> types;
  for (auto it = frame.begin(); it != frame.end(); ++it) types.push_back(it.slice().type);
  std::vector<char> lines;
  for (int b = 0; b < blocks; ++b) {
    const std::uint64_t start = stream.tellp();
    stream.seekp(table + sizeof(std::uint64_t) * static_cast<std::uint64_t>(b));
    put<std::uint64_t>(stream, start);
    stream.seekp(start);
    const int row = b * kBlockRows;
    gather(frame, size.x, row, std::min(kBlockRows, size.y - row), lines);
    const std::span<const char> packed =
        packer.pack(lines, types, static_cast<std::size_t>(size.x));
    put<std::int32_t>(stream, row);
    put<std::int32_t>(stream, static_cast<std::int32_t>(packed.size()));
    stream.write(packed.data(), static_cast<int>(packed.size()));
  }
}

}  // namespace

void write_exr(const std::filesystem::path& path, const ChannelImage& image,
               const ExrWriteOptions& options) {
  Imf::Header header(image.width, image.height);
  header.compression() = imf_compression(options.compression);
  if (options.camera) add_camera(header, *options.camera);
  for (const auto& [name, text] : options.notes) header.insert(name, Imf::StringAttribute(text));
  Imf::FrameBuffer frame;
  std::deque<std::vector<half>> halves;
  for (const Channel& channel : image.channels) {
    const Imf::Slice slice = slice_of(channel, image.width, halves);
    header.channels().insert(channel.name, Imf::Channel(slice.type));
    frame.insert(channel.name, slice);
  }
  MemorySink stream;
  try {
    if (options.compression == ExrCompression::zip) {
      write_packed(stream, header, frame, {ExrPacker::Method::zip, options.zip_level});
    } else if (options.compression == ExrCompression::pxr24) {
      write_packed(stream, header, frame, {ExrPacker::Method::pxr24, options.zip_level});
    } else {
      Imf::OutputFile file(stream, header, 0);
      file.setFrameBuffer(frame);
      file.writePixels(image.height);
    }
  } catch (const std::exception& error) {
    throw IoError::writing(path, error.what());
  }
  write_file_atomically(path, stream.bytes());
}

}  // namespace organbake
