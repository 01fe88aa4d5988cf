// SPDX-License-Identifier: Apache-2.0
#include "organbake/image/exr_reader.h"

#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "exr_header.h"
#include "exr_zip.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

class MemorySource : public Imf::IStream {
 public:
  MemorySource(std::span<const std::byte> bytes, const std::string& name)
      : Imf::IStream(name.c_str()), bytes_(bytes) {}
  bool read(char* target, int count) override {
    if (count < 0 || bytes_.size() - position_ < static_cast<std::size_t>(count)) {
      throw std::runtime_error("ends early");
    }
    std::memcpy(target, bytes_.data() + position_, count);
    position_ += count;
    return position_ < bytes_.size();
  }
  // OpenEXR then looks at blocks where they lie. It never writes to them.
  bool isMemoryMapped() const override { return true; }
  char* readMemoryMapped(int count) override {
    if (count < 0 || bytes_.size() - position_ < static_cast<std::size_t>(count)) {
      throw std::runtime_error("ends early");
    }
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

char* bytes_of(Channel& channel) {
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
                                          bytes_of(channel) - 4 * first, 4, 4 * image.width));
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
    for (Channel& channel : image.channels) {
      if (channel.name != it.name()) continue;
      lines.planes.push_back({half ? ExrPlane::Kind::half_to_float : ExrPlane::Kind::four_bytes,
                              lines.line_bytes, bytes_of(channel)});
    }
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
    switch (file.header().compression()) {
      case Imf::ZIP_COMPRESSION:
        read_zip(file, 16, image);
        break;
      case Imf::ZIPS_COMPRESSION:
        read_zip(file, 1, image);
        break;
      default:
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
