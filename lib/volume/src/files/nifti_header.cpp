// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/nifti_header.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <string_view>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr std::int32_t kSize1 = 348, kSize2 = 540;

// The bytes of a header, read as numbers at offsets.
class HeaderBytes {
 public:
  explicit HeaderBytes(ByteStream& stream) : stream_(stream) { extend(kSize1); }

  void extend(std::size_t size) {
    const std::size_t before = bytes_.size();
    bytes_.resize(size);
    if (stream_.read(std::span(bytes_).subspan(before)) < size - before) {
      throw BadDataError(stream_.file(), "too short for a NIfTI header");
    }
  }
  template <typename T>
  T get(std::size_t offset) const {
    std::array<std::byte, sizeof(T)> raw;
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), sizeof(T), raw.begin());
    if (swapped) std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }
  // Consecutive numbers of type T as the target's elements.
  template <typename T, typename Target, std::size_t N>
  void get_all(std::size_t offset, std::array<Target, N>& out) const {
    for (std::size_t i = 0; i < N; ++i) {
      out[i] = static_cast<Target>(get<T>(offset + i * sizeof(T)));
    }
  }
  std::string_view text(std::size_t offset, std::size_t count) const {
    return {reinterpret_cast<const char*>(&bytes_[offset]), count};
  }

  bool swapped = false;

 private:
  ByteStream& stream_;
  std::vector<std::byte> bytes_;
};

void take_nifti1(const HeaderBytes& bytes, NiftiHeader& header) {
  bytes.get_all<std::int16_t>(40, header.dim);
  bytes.get_all<float>(76, header.pixdim);
  header.datatype = bytes.get<std::int16_t>(70);
  header.data_offset = bytes.get<float>(108);
  header.slope = bytes.get<float>(112);
  header.intercept = bytes.get<float>(116);
  header.units = bytes.get<std::uint8_t>(123);
  header.qform_code = bytes.get<std::int16_t>(252);
  header.sform_code = bytes.get<std::int16_t>(254);
  bytes.get_all<float>(256, header.quaternion);
  bytes.get_all<float>(280, header.srow);
}

void take_nifti2(const HeaderBytes& bytes, NiftiHeader& header) {
  header.datatype = bytes.get<std::int16_t>(12);
  bytes.get_all<std::int64_t>(16, header.dim);
  bytes.get_all<double>(104, header.pixdim);
  header.data_offset = static_cast<double>(bytes.get<std::int64_t>(168));
  header.slope = bytes.get<double>(176);
  header.intercept = bytes.get<double>(184);
  header.qform_code = bytes.get<std::int32_t>(344);
  header.sform_code = bytes.get<std::int32_t>(348);
  bytes.get_all<double>(352, header.quaternion);
  bytes.get_all<double>(400, header.srow);
  header.units = bytes.get<std::int32_t>(500);
}

// "n+1" with the voxels in the same file, "ni1" with them beside it; 2 for NIfTI-2.
bool told_apart(const HeaderBytes& bytes, bool second, const std::string& name) {
  const std::string_view magic = bytes.text(second ? 4 : 344, 3);
  if (magic == (second ? "n+2" : "n+1")) return false;
  if (magic == (second ? "ni2" : "ni1")) return true;
  throw BadDataError(name +
                     ": is an Analyze file, which doesn't tell left from right; save it as NIfTI "
                     "(.nii.gz) in the program that made it");
}

}  // namespace

NiftiHeader::NiftiHeader(ByteStream& stream) : name(stream.file().string()) {
  HeaderBytes bytes(stream);
  const auto as_stored = bytes.get<std::int32_t>(0);
  bytes.swapped = true;
  const auto as_swapped = bytes.get<std::int32_t>(0);
  bytes.swapped = as_stored != kSize1 && as_stored != kSize2;
  const std::int32_t size = bytes.swapped ? as_swapped : as_stored;
  if (size != kSize1 && size != kSize2) throw BadDataError(name + ": is not NIfTI");
  big_endian = bytes.swapped;
  const bool second = size == kSize2;
  if (second) bytes.extend(kSize2);
  header_bytes = static_cast<std::uint64_t>(size);
  voxels_apart = told_apart(bytes, second, name);
  second ? take_nifti2(bytes, *this) : take_nifti1(bytes, *this);
}

std::int64_t NiftiHeader::time_points() const {
  const bool has_time = dim[0] >= 4 && dim[0] <= 7;
  return has_time ? dim[4] : 1;
}

std::string NiftiHeader::time_step() const {
  static const std::map<int, const char*> kUnits = {{8, " s"}, {16, " ms"}, {24, " µs"}};
  const auto unit = kUnits.find(units & 0x38);
  if (unit == kUnits.end() || !(pixdim[4] > 0)) return {};
  return "every " + to_text(pixdim[4]) + unit->second;
}

VoxelEncoding NiftiHeader::encoding() const {
  static const std::map<int, ScalarType> kTypes = {
      {2, ScalarType::uint8},    {4, ScalarType::int16},    {8, ScalarType::int32},
      {16, ScalarType::float32}, {64, ScalarType::float64}, {256, ScalarType::int8},
      {512, ScalarType::uint16}, {768, ScalarType::uint32}, {1024, ScalarType::int64},
      {1280, ScalarType::uint64}};
  const auto type = kTypes.find(datatype);
  if (type == kTypes.end()) {
    throw BadDataError(name + ": holds NIfTI data type " + std::to_string(datatype) +
                       "; integers or real numbers are needed");
  }
  VoxelEncoding encoding{type->second, big_endian, 1, 0};
  // Slope 0 means "no scaling" by the standard.
  if (std::isfinite(slope) && std::isfinite(intercept) && slope != 0) {
    encoding.slope = slope;
    encoding.intercept = intercept;
  }
  return encoding;
}

double NiftiHeader::millimetres_per_unit() const {
  switch (units & 7) {
    case 1:
      return 1000;
    case 3:
      return 0.001;
    default:
      return 1;  // millimetres, or not said
  }
}

NiftiAffine NiftiHeader::sform() const {
  const auto rows = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(srow.data());
  return {rows.leftCols<3>(), rows.col(3)};
}

NiftiAffine NiftiHeader::qform() const {
  const double b = quaternion[0], c = quaternion[1], d = quaternion[2];
  const double squares = b * b + c * c + d * d;
  Eigen::Quaterniond rotation(std::sqrt(std::max(0.0, 1 - squares)), b, c, d);
  rotation.normalize();
  const double handedness = pixdim[0] < 0 ? -1 : 1;
  const Eigen::Vector3d scale(pixdim[1], pixdim[2], handedness * pixdim[3]);
  return {rotation.toRotationMatrix() * scale.asDiagonal(),
          {quaternion[3], quaternion[4], quaternion[5]}};
}

}  // namespace organbake
