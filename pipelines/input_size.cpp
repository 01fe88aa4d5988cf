// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/input_size.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/file_ending.h"
#include "core/files.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr double kBytesPerVoxel = 2;  // CT is stored in 16 bits

// The number of voxels that a text header's line "key = 57 78 64" or "key: …" tells; 0 when it has
// none.
double product_in_header(const fs::path& file, const std::string& key) {
  constexpr std::size_t kMostHeader = 4096;
  std::string head(kMostHeader, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(kMostHeader));
  std::istringstream lines(head);
  std::string line;
  while (std::getline(lines, line)) {
    if (!line.starts_with(key)) continue;
    std::istringstream numbers(line.substr(line.find_first_of("=:") + 1));
    double product = 1, number = 0;
    bool any = false;
    while (numbers >> number) {
      product *= number;
      any = true;
    }
    return any ? product : 0;
  }
  return 0;
}

// A gzip file ends with the size of what it holds, modulo 2³².
double unpacked_bytes(const fs::path& file) {
  std::array<unsigned char, 4> tail{};
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(-4, std::ios::end);
  if (!stream.read(reinterpret_cast<char*>(tail.data()), tail.size())) return bytes_of(file);
  const double size = tail[0] + 256.0 * (tail[1] + 256.0 * (tail[2] + 256.0 * tail[3]));
  return std::max(size, bytes_of(file));
}

}  // namespace

double bytes_of(const fs::path& path) {
  if (!fs::exists(path)) throw NoInputError(path, "does not exist");
  if (!fs::is_directory(path)) return static_cast<double>(fs::file_size(path));
  double bytes = 0;
  for (const fs::path& file : list_files(path)) {
    bytes += static_cast<double>(fs::file_size(path / file));
  }
  return bytes;
}

double voxels_in(const fs::path& volume) {
  const double bytes = bytes_of(volume);
  if (fs::is_directory(volume)) return bytes / kBytesPerVoxel;
  const std::string ending = volume.extension().string();
  if (ending == ".gz") return unpacked_bytes(volume) / kBytesPerVoxel;
  double voxels = 0;
  if (ending == ".mha" || ending == ".mhd") voxels = product_in_header(volume, "DimSize");
  if (ending == ".nrrd" || ending == ".nhdr") voxels = product_in_header(volume, "sizes");
  return voxels > 0 ? voxels : bytes / kBytesPerVoxel;
}

double pixels_beside(const fs::path& cameras) {
  constexpr double kBytesPerPixel = 1;  // of a photograph as PNG; of JPEG far less
  double bytes = 0;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(fs::absolute(cameras).parent_path())) {
    if (entry.is_regular_file() && is_picture_name(entry.path())) {
      bytes += static_cast<double>(entry.file_size());
    }
  }
  return bytes / kBytesPerPixel;
}

double frames_in(const fs::path& clip) {
  const double bytes = bytes_of(clip);
  if (fs::is_directory(clip)) {
    const std::vector<fs::path> files = list_files(clip);
    return static_cast<double>(std::count_if(files.begin(), files.end(), is_frame_name));
  }
  if (is_frame_name(clip)) return 1;
  constexpr double kBytesPerFrame = 10e3;  // 2 Mbit/s at 25 a second: as small as clips come
  return std::max(1.0, bytes / kBytesPerFrame);
}

}  // namespace organbake
