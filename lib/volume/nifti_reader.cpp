// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/nifti_reader.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "core/error.h"
#include "core/text.h"
#include "volume/grid.h"
#include "volume/voxel_decoding.h"

namespace organbake {
namespace {

constexpr std::size_t kHeaderBytes = 348;

// The header's fields at the byte offsets of nifti1.h.
class NiftiHeader {
 public:
  explicit NiftiHeader(ByteStream& stream) : name_(stream.file().string()) {
    if (stream.read(bytes_) < kHeaderBytes) {
      throw BadDataError(name_ + ": too short for a NIfTI header");
    }
    const std::int32_t as_stored = get<std::int32_t>(0);
    swapped_ = true;
    const std::int32_t as_swapped = get<std::int32_t>(0);
    constexpr std::int32_t kSize = kHeaderBytes, kNifti2Size = 540;
    if (as_stored == kNifti2Size || as_swapped == kNifti2Size) {
      throw BadDataError(name_ + ": is NIfTI-2; save it as NIfTI-1");
    }
    if (as_stored != kSize && as_swapped != kSize) throw BadDataError(name_ + ": is not NIfTI");
    swapped_ = as_stored != kSize;
    if (std::memcmp(&bytes_[344], "n+1", 3) != 0) {
      throw BadDataError(name_ +
                         ": is not single-file NIfTI (.hdr/.img pairs and Analyze files "
                         "are not read); save it as .nii");
    }
  }

  template <typename T>
  T get(std::size_t offset) const {
    std::array<std::byte, sizeof(T)> raw;
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), sizeof(T), raw.begin());
    if (swapped_) std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }
  std::int16_t dim(int i) const { return get<std::int16_t>(40 + 2 * i); }
  double pixdim(int i) const { return get<float>(76 + 4 * i); }
  bool swapped() const { return swapped_; }
  const std::string& name() const { return name_; }

 private:
  std::string name_;
  std::array<std::byte, kHeaderBytes> bytes_{};
  bool swapped_ = false;
};

std::array<int, 3> size_of(const NiftiHeader& header) {
  const int dimensions = header.dim(0);
  bool three = dimensions >= 3 && dimensions <= 7;
  for (int i = 4; three && i <= dimensions; ++i) three = header.dim(i) == 1;
  if (!three) {
    throw BadDataError(header.name() + ": has " + std::to_string(dimensions) +
                       " dimensions; a single 3-D volume is needed");
  }
  checked_voxel_count({header.dim(1), header.dim(2), header.dim(3)}, header.name());
  return {header.dim(1), header.dim(2), header.dim(3)};
}

VoxelEncoding encoding_of(const NiftiHeader& header) {
  static const std::map<int, VoxelType> kTypes = {
      {2, VoxelType::uint8},    {4, VoxelType::int16},    {8, VoxelType::int32},
      {16, VoxelType::float32}, {64, VoxelType::float64}, {256, VoxelType::int8},
      {512, VoxelType::uint16}, {768, VoxelType::uint32}, {1024, VoxelType::int64},
      {1280, VoxelType::uint64}};
  const auto type = kTypes.find(header.get<std::int16_t>(70));
  if (type == kTypes.end()) {
    throw BadDataError(header.name() + ": holds NIfTI data type " +
                       std::to_string(header.get<std::int16_t>(70)) +
                       "; integers or real numbers are needed");
  }
  VoxelEncoding encoding{type->second, header.swapped(), 1, 0};
  const double slope = header.get<float>(112), intercept = header.get<float>(116);
  // Slope 0 means "no scaling" by the standard.
  if (std::isfinite(slope) && std::isfinite(intercept) && slope != 0) {
    encoding.slope = slope;
    encoding.intercept = intercept;
  }
  return encoding;
}

struct Affine {
  Eigen::Matrix3d axes;
  Eigen::Vector3d origin;
};

Affine sform(const NiftiHeader& header) {
  Affine affine;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      const double value = header.get<float>(static_cast<std::size_t>(280 + 16 * row + 4 * column));
      if (column < 3) {
        affine.axes(row, column) = value;
      } else {
        affine.origin[row] = value;
      }
    }
  }
  return affine;
}

Affine qform(const NiftiHeader& header) {
  const double b = header.get<float>(256), c = header.get<float>(260), d = header.get<float>(264);
  const double squares = b * b + c * c + d * d;
  Eigen::Quaterniond rotation(std::sqrt(std::max(0.0, 1 - squares)), b, c, d);
  rotation.normalize();
  const double handedness = header.pixdim(0) < 0 ? -1 : 1;
  const Eigen::Vector3d scale(header.pixdim(1), header.pixdim(2), handedness * header.pixdim(3));
  return {rotation.toRotationMatrix() * scale.asDiagonal(),
          {header.get<float>(268), header.get<float>(272), header.get<float>(276)}};
}

double millimetres_per_unit(const NiftiHeader& header) {
  switch (header.get<std::uint8_t>(123) & 7) {
    case 1:
      return 1000;
    case 3:
      return 0.001;
    default:
      return 1;  // millimetres, or not said
  }
}

void place(const NiftiHeader& header, Volume& volume) {
  const bool has_qform = header.get<std::int16_t>(252) > 0;
  const bool has_sform = header.get<std::int16_t>(254) > 0;
  Affine ras;
  if (has_sform) {
    ras = sform(header);
  } else if (has_qform) {
    ras = qform(header);
  } else {
    ras = {Eigen::Vector3d(header.pixdim(1), header.pixdim(2), header.pixdim(3)).asDiagonal(),
           Eigen::Vector3d::Zero()};
    volume.warnings.push_back(
        "the NIfTI header has no position or orientation; voxel sizes alone were used, RAS");
  }
  if (has_sform && has_qform) {
    const Affine other = qform(header);
    const Eigen::Vector3d far(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
    const double apart =
        std::max((ras.origin - other.origin).norm(),
                 (ras.axes * far + ras.origin - other.axes * far - other.origin).norm());
    constexpr double kWorthTelling_mm = 0.5;
    if (apart > kWorthTelling_mm) {
      volume.warnings.push_back("the NIfTI header's sform and qform differ by up to " +
                                to_text(apart, 1) + " mm; the sform was used");
    }
  }
  const double unit = millimetres_per_unit(header);
  set_grid(volume, unit * lps_from_ras(ras.axes), unit * lps_from_ras(ras.origin), header.name());
}

}  // namespace

Volume read_nifti(const std::filesystem::path& path, ByteStream::Coding coding,
                  const VolumeReadOptions& options) {
  ByteStream stream(path, coding);
  const NiftiHeader header(stream);
  Volume volume;
  volume.size = size_of(header);
  place(header, volume);
  const double data_offset = header.get<float>(108);
  if (!(data_offset >= kHeaderBytes && data_offset < 1e9)) {
    throw BadDataError(path, "its voxels are said to start at byte " + to_text(data_offset));
  }
  stream.skip(static_cast<std::uint64_t>(data_offset) - kHeaderBytes);
  if (options.region) {
    const IndexBox box = voxels_of_region(volume, *options.region, path.string());
    decode_box(stream, encoding_of(header), box, volume);
    return volume;
  }
  decode_voxels(stream, encoding_of(header), volume);
  // Reading past the voxels makes the decompressor check its sum over all that came before.
  std::byte beyond;
  stream.read({&beyond, 1});
  return volume;
}

}  // namespace organbake
