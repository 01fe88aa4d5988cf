// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/ramp_volume.h"

#include <zlib.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <iterator>

#include "organbake/volume/read_volume.h"

namespace organbake {

double ramp_hu(const Eigen::Vector3d& world_mm) {
  return 12 * world_mm.x() - 7 * world_mm.y() + 5 * world_mm.z() - 100;
}

Eigen::Matrix3d oblique_direction() {
  return (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

Volume ramp_volume(const Eigen::Matrix3d& direction, const Eigen::Vector3d& origin_mm) {
  Volume volume;
  volume.size = {5, 4, 3};
  volume.spacing_mm = {0.8, 1.25, 3};
  volume.direction = direction;
  volume.origin_mm = origin_mm;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 5; ++i) {
        const double hu = ramp_hu(volume.world_from_index(Eigen::Vector3d(i, j, k)));
        volume.voxels.push_back(static_cast<std::int16_t>(std::lround(hu)));
      }
    }
  }
  return volume;
}

double largest_ramp_error(const Volume& volume) {
  double largest = 0;
  for (int k = 0; k < volume.size[2]; ++k) {
    for (int j = 0; j < volume.size[1]; ++j) {
      for (int i = 0; i < volume.size[0]; ++i) {
        const double hu = ramp_hu(volume.world_from_index(Eigen::Vector3d(i, j, k)));
        largest = std::max(largest, std::abs(hu - volume.at(i, j, k)));
      }
    }
  }
  return largest;
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string gzipped(const std::string& bytes) {
  z_stream z{};
  constexpr int kGzip = 16 + MAX_WBITS;
  deflateInit2(&z, 6, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&z, bytes.size()), '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  deflate(&z, Z_FINISH);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

const Volume& dicom_abdomen() {
  static const Volume volume = read_volume(shared_data("ct/abdomen/example_ct_dicom"));
  return volume;
}

std::string voxel_bytes(const Volume& volume) {
  return {reinterpret_cast<const char*>(volume.voxels.data()), volume.voxels.size() * 2};
}

}  // namespace organbake
