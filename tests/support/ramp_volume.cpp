// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/ramp_volume.h"

#include <zlib.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
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
  for_each_voxel(volume.size, [&](int i, int j, int k) {
    const double hu = ramp_hu(volume.world_from_index(Eigen::Vector3d(i, j, k)));
    volume.voxels.push_back(static_cast<std::int16_t>(std::lround(hu)));
  });
  return volume;
}

double largest_ramp_error(const Volume& volume) {
  double largest = 0;
  for_each_voxel(volume.size, [&](int i, int j, int k) {
    const double hu = ramp_hu(volume.world_from_index(Eigen::Vector3d(i, j, k)));
    largest = std::max(largest, std::abs(hu - volume.at(i, j, k)));
  });
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

namespace {

const Eigen::Vector3d kRasFromLps(-1, -1, 1);

class HeaderBytes {
 public:
  explicit HeaderBytes(bool big_endian, std::size_t size = 348)
      : big_endian_(big_endian), bytes_(size, '\0') {}
  template <typename T>
  void put(std::size_t offset, T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big_endian_) std::reverse(raw, raw + sizeof(T));
    bytes_.replace(offset, sizeof(T), raw, sizeof(T));
  }
  std::string& bytes() { return bytes_; }

 private:
  bool big_endian_;
  std::string bytes_;
};

}  // namespace

NiftiBytes::NiftiBytes(const Volume& volume) : voxels(voxel_bytes(volume)) {
  const Eigen::Matrix3d axes =
      kRasFromLps.asDiagonal() * volume.direction * volume.spacing_mm.asDiagonal();
  for (int row = 0; row < 3; ++row) {
    dim[static_cast<std::size_t>(row + 1)] = static_cast<std::int16_t>(volume.size[row]);
    pixdim[static_cast<std::size_t>(row + 1)] = static_cast<float>(volume.spacing_mm[row]);
    for (int column = 0; column < 3; ++column) {
      sform[4 * row + column] = static_cast<float>(axes(row, column));
    }
    sform[4 * row + 3] = static_cast<float>(kRasFromLps[row] * volume.origin_mm[row]);
  }
}

void NiftiBytes::set_qform(const Volume& volume) {
  Eigen::Matrix3d direction = kRasFromLps.asDiagonal() * volume.direction;
  pixdim[0] = direction.determinant() < 0 ? -1 : 1;
  direction.col(2) *= pixdim[0];
  Eigen::Quaterniond q(direction);
  if (q.w() < 0) q.coeffs() *= -1;
  const Eigen::Vector3d origin = kRasFromLps.cwiseProduct(volume.origin_mm);
  const double values[6] = {q.x(), q.y(), q.z(), origin.x(), origin.y(), origin.z()};
  std::transform(values, values + 6, quaternion, [](double v) { return static_cast<float>(v); });
  qform_code = 1;
}

void NiftiBytes::set_named_labels() {
  std::string xml(8, '\0');
  xml +=
      "<CaretExtension><LabelTable><Label Key=\"5\" Red=\"0\"><![CDATA[liver]]></Label>"
      "<Label Key=\"11\">gall bladder</Label><Label Key=\"x\">none</Label></LabelTable>";
  xml.resize(512, '\0');
  vox_offset = 352 + 512;
  for (std::size_t i = 0; i < voxels.size(); i += 2) {
    voxels[i] = static_cast<char>(i % 4 == 0 ? 5 : 11);
    voxels[i + 1] = 0;
  }
  voxels = xml + voxels;
}

std::string NiftiBytes::bytes() const {
  HeaderBytes header(big_endian);
  header.put(0, sizeof_hdr);
  for (std::size_t i = 0; i < 8; ++i) {
    header.put(40 + 2 * i, dim[i]);
    header.put(76 + 4 * i, pixdim[i]);
  }
  header.put(70, datatype);
  header.put(108, vox_offset);
  header.put(112, slope);
  header.put(116, intercept);
  header.put(123, units);
  header.put(252, qform_code);
  header.put(254, sform_code);
  for (std::size_t i = 0; i < 6; ++i) header.put(256 + 4 * i, quaternion[i]);
  for (std::size_t i = 0; i < 12; ++i) header.put(280 + 4 * i, sform[i]);
  header.bytes().replace(344, 4, magic);
  return header.bytes() + std::string(4, '\0') + voxels;
}

std::string NiftiBytes::bytes_nifti2() const {
  HeaderBytes header(big_endian, 540);
  header.put(0, std::int32_t{540});
  header.put(12, datatype);
  for (std::size_t i = 0; i < 8; ++i) {
    header.put(16 + 8 * i, static_cast<std::int64_t>(dim[i]));
    header.put(104 + 8 * i, static_cast<double>(pixdim[i]));
  }
  header.put(168, std::int64_t{544});
  header.put(176, static_cast<double>(slope));
  header.put(184, static_cast<double>(intercept));
  header.put(344, static_cast<std::int32_t>(qform_code));
  header.put(348, static_cast<std::int32_t>(sform_code));
  for (std::size_t i = 0; i < 6; ++i) header.put(352 + 8 * i, static_cast<double>(quaternion[i]));
  for (std::size_t i = 0; i < 12; ++i) header.put(400 + 8 * i, static_cast<double>(sform[i]));
  header.put(500, static_cast<std::int32_t>(units));
  header.bytes().replace(4, 8, std::string("n+2\0\r\n\032\n", 8));
  return header.bytes() + std::string(4, '\0') + voxels;
}

void NiftiBytes::swap_to_big_endian() {
  big_endian = true;
  for (std::size_t i = 0; i + 1 < voxels.size(); i += 2) std::swap(voxels[i], voxels[i + 1]);
}

}  // namespace organbake
