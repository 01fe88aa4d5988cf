// SPDX-License-Identifier: Apache-2.0
#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>

#include <cstring>
#include <deque>
#include <string>

#include "core/error.h"
#include "core/files.h"
#include "image/exr.h"

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

}  // namespace

void write_exr(const std::filesystem::path& path, const ChannelImage& image,
               const ExrWriteOptions& options) {
  Imf::Header header(image.width, image.height);
  header.compression() = imf_compression(options.compression);
  header.zipCompressionLevel() = options.zip_level;
  if (options.camera) add_camera(header, *options.camera);
  Imf::FrameBuffer frame;
  std::deque<std::vector<half>> halves;
  for (const Channel& channel : image.channels) {
    const Imf::Slice slice = slice_of(channel, image.width, halves);
    header.channels().insert(channel.name, Imf::Channel(slice.type));
    frame.insert(channel.name, slice);
  }
  MemorySink stream;
  try {
    Imf::OutputFile file(stream, header, 0);
    file.setFrameBuffer(frame);
    file.writePixels(image.height);
  } catch (const std::exception& error) {
    throw IoError::writing(path, error.what());
  }
  write_file_atomically(path, stream.bytes());
}

}  // namespace organbake
