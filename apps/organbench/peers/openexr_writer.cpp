// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/openexr_writer.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>

#include <deque>
#include <vector>

namespace organbake {

void write_by_openexr(const std::filesystem::path& file, const ChannelImage& image) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer frame;
  std::deque<std::vector<half>> halves;
  const auto add = [&](const Channel& channel, Imf::PixelType type, const void* values,
                       std::size_t bytes) {
    header.channels().insert(channel.name, Imf::Channel(type));
    char* const base = const_cast<char*>(static_cast<const char*>(values));
    frame.insert(channel.name, Imf::Slice(type, base, bytes, bytes * image.width));
  };
  for (const Channel& channel : image.channels) {
    if (const auto* whole = std::get_if<std::vector<std::uint32_t>>(&channel.values)) {
      add(channel, Imf::UINT, whole->data(), sizeof(std::uint32_t));
    } else if (channel.half) {
      halves.emplace_back(channel.floats().begin(), channel.floats().end());
      add(channel, Imf::HALF, halves.back().data(), sizeof(half));
    } else {
      add(channel, Imf::FLOAT, channel.floats().data(), sizeof(float));
    }
  }
  Imf::OutputFile output(file.c_str(), header, 0);
  output.setFrameBuffer(frame);
  output.writePixels(image.height);
}

}  // namespace organbake
