// SPDX-License-Identifier: Apache-2.0
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfTestFile.h>
#include <ImfVersion.h>

#include <cstring>
#include <limits>
#include <stdexcept>

#include "core/error.h"
#include "core/files.h"
#include "image/exr.h"

namespace organbake {
namespace {

class MemoryStream : public Imf::IStream {
 public:
  MemoryStream(std::span<const std::byte> bytes, const std::string& name)
      : Imf::IStream(name.c_str()), bytes_(bytes) {}
  bool read(char* target, int count) override {
    if (count < 0 || bytes_.size() - position_ < static_cast<std::size_t>(count)) {
      throw std::runtime_error("ends early");
    }
    std::memcpy(target, bytes_.data() + position_, count);
    position_ += count;
    return position_ < bytes_.size();
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

void refuse(bool bad, const std::string& why) {
  if (bad) throw std::runtime_error(why);
}

// Sizes are checked before any pixel memory is taken: a damaged header may claim anything.
void check_header(const Imf::InputFile& file, std::size_t max_pixels) {
  refuse(Imf::isTiled(file.version()), "is tiled; scan lines are read here");
  refuse(Imf::isNonImage(file.version()), "holds deep data");
  refuse(Imf::isMultiPart(file.version()), "has several parts");
  const Imath::Box2i window = file.header().dataWindow();
  const std::int64_t width = std::int64_t(window.max.x) - window.min.x + 1;
  const std::int64_t height = std::int64_t(window.max.y) - window.min.y + 1;
  refuse(width < 1 || height < 1 || width > std::numeric_limits<int>::max() / 64 ||
             static_cast<std::uint64_t>(height) > max_pixels / static_cast<std::uint64_t>(width),
         "claims " + std::to_string(width) + " × " + std::to_string(height) + " pixels");
  const Imf::ChannelList& channels = file.header().channels();
  for (auto it = channels.begin(); it != channels.end(); ++it) {
    refuse(it.channel().xSampling != 1 || it.channel().ySampling != 1,
           std::string("channel '") + it.name() + "' is subsampled");
  }
}

ChannelImage read_pixels(Imf::InputFile& file) {
  const Imath::Box2i window = file.header().dataWindow();
  ChannelImage image;
  image.width = window.max.x - window.min.x + 1;
  image.height = window.max.y - window.min.y + 1;
  const Imf::ChannelList& list = file.header().channels();
  for (auto it = list.begin(); it != list.end(); ++it) {
    Channel channel{it.name(), {}, it.channel().type == Imf::HALF};
    if (it.channel().type == Imf::UINT) {
      channel.values = std::vector<std::uint32_t>(image.pixel_count());
    } else {
      channel.values = std::vector<float>(image.pixel_count());
    }
    image.channels.push_back(std::move(channel));
  }
  Imf::FrameBuffer frame;
  const std::int64_t first = window.min.x + std::int64_t(window.min.y) * image.width;
  for (Channel& channel : image.channels) {
    std::visit(
        [&](auto& values) {
          using Value = typename std::remove_reference_t<decltype(values)>::value_type;
          constexpr auto kType = std::is_same_v<Value, float> ? Imf::FLOAT : Imf::UINT;
          // OpenEXR addresses pixels by window coordinates from a base that may lie before the
          // data.
          char* base = reinterpret_cast<char*>(values.data()) - first * std::int64_t(sizeof(Value));
          frame.insert(channel.name,
                       Imf::Slice(kType, base, sizeof(Value), sizeof(Value) * image.width));
        },
        channel.values);
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return image;
}

}  // namespace

ChannelImage parse_exr(std::span<const std::byte> bytes, const std::string& name,
                       std::size_t max_pixels) {
  try {
    MemoryStream stream(bytes, name);
    Imf::InputFile file(stream, 0);
    check_header(file, max_pixels);
    return read_pixels(file);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw BadDataError(name + ": is not a readable EXR image: " + error.what());
  }
}

ChannelImage read_exr(const std::filesystem::path& path, std::size_t max_pixels) {
  return parse_exr(read_file(path), path.string(), max_pixels);
}

}  // namespace organbake
