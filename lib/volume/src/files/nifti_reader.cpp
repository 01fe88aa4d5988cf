// SPDX-License-Identifier: GPL-3.0-or-later
// Reads NIfTI-1 and NIfTI-2 (nifti1.h, Cox et al. 2004; nifti2.h, 2011) of either byte order, in
// one file or two: where the voxels lie, turned from RAS to LPS, and these as they are.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "files/volume_files.h"
#include "grid/grids.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

// How voxels lie in the world, millimetres (RAS): columns of axes per index, place of index 0.
struct NiftiAffine {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

// What the header of a NIfTI-1 or NIfTI-2 file says, of either byte order and either layout.
// Sources: nifti1.h (Cox et al. 2004), nifti2.h (2011).
struct NiftiHeader {
  // Reads it off the front of a stream. Throws BadDataError: no NIfTI, Analyze, too short.
  explicit NiftiHeader(ByteStream& stream);

  std::string name;  // of the file, for errors
  bool big_endian = false;
  bool voxels_apart = false;  // in an .img beside the header
  std::uint64_t header_bytes = 0;
  double data_offset = 0;             // of the voxels in their file
  std::array<std::int64_t, 8> dim{};  // how many dimensions, then their sizes
  std::array<double, 8> pixdim{};     // handedness of the qform, then voxel sizes
  int datatype = 0;
  double slope = 0, intercept = 0;
  int qform_code = 0, sform_code = 0;
  int units = 0;  // of space in the lowest three bits, of time in the next three
  std::array<double, 6> quaternion{};  // b, c, d, then the offset
  std::array<double, 12> srow{};       // rows of the sform's 3×4 matrix

  std::int64_t time_points() const;  // volumes one after another; 1 = a plain one
  std::string time_step() const;     // "every 0.5 s", or nothing
  VoxelEncoding encoding() const;
  double millimetres_per_unit() const;
  NiftiAffine sform() const;
  NiftiAffine qform() const;
};

constexpr std::int32_t kSize1 = 348, kSize2 = 540;

// The bytes of a header, read as numbers at offsets.
class HeaderBytes {
 public:
  explicit HeaderBytes(ByteStream& stream) : stream_(stream) { extend(kSize1); }

  void extend(std::size_t size) {
    const std::size_t before = bytes_.size();
    bytes_.resize(size);
    if (stream_.read(std::span(bytes_).subspan(before)) < size - before)
      throw BadDataError(stream_.file(), "too short for a NIfTI header");
  }
  template <typename T>
  T get(std::size_t offset) const {
    return bytes_as<T>(&bytes_[offset], swapped);
  }
  // Consecutive numbers of type T as the target's elements.
  template <typename T, typename Target, std::size_t N>
  void get_all(std::size_t offset, std::array<Target, N>& out) const {
    for (std::size_t i = 0; i < N; ++i)
      out[i] = static_cast<Target>(get<T>(offset + i * sizeof(T)));
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
  if (type == kTypes.end())
    throw BadDataError(name + ": holds NIfTI data type " + std::to_string(datatype) +
                       "; integers or real numbers are needed");
  VoxelEncoding encoding{type->second, big_endian, 1, 0};
  // Slope 0 means "no scaling" by the standard.
  if (std::isfinite(slope) && std::isfinite(intercept) && slope != 0) {
    encoding.slope = slope;
    encoding.intercept = intercept;
  }
  return encoding;
}

double NiftiHeader::millimetres_per_unit() const {
  const int unit = units & 7;
  return unit == 1 ? 1000 : unit == 3 ? 0.001 : 1;  // metres, micrometres; millimetres or not said
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

namespace fs = std::filesystem;

constexpr std::uint64_t kLongestExtension = std::uint64_t{1} << 22;

// The text of an element whose opening tag ends at `at`, plain or as CDATA.
std::string element_text(const std::string& xml, std::size_t at) {
  constexpr std::string_view kOpen = "<![CDATA[", kClose = "]]>";
  at = xml.find_first_not_of(" \t\r\n", at);
  if (at == std::string::npos) return {};
  if (xml.compare(at, kOpen.size(), kOpen) == 0) {
    at += kOpen.size();
    return trimmed(xml.substr(at, xml.find(kClose, at) - at));
  }
  return trimmed(xml.substr(at, xml.find('<', at) - at));
}

// The names of a mask's labels from the extensions behind a NIfTI header, where `left` bytes lie
// before the voxels; `left` falls by what was read. TotalSegmentator and Connectome Workbench write
// a label table as XML. None when there is no such table.
std::vector<LabelName> read_nifti_labels(ByteStream& stream, std::uint64_t& left) {
  std::string xml(static_cast<std::size_t>(std::min(left, kLongestExtension)), '\0');
  stream.read_exactly(std::as_writable_bytes(std::span(xml)));
  left -= xml.size();
  std::vector<LabelName> names;
  constexpr std::string_view kElement = "<Label ", kKey = "Key=\"";
  for (std::size_t at = 0; (at = xml.find(kElement, at)) != std::string::npos;) {
    const std::size_t close = xml.find('>', at), key = xml.find(kKey, at);
    at += kElement.size();
    if (close == std::string::npos || key > close) continue;
    const std::size_t number = key + kKey.size();
    const auto label =
        number_in<int>(xml.substr(number, xml.find_first_not_of("0123456789", number) - number));
    const std::string name = element_text(xml, close + 1);
    if (label && *label > 0 && !name.empty()) names.push_back({*label, name});
  }
  return names;
}

// "scan.hdr" and "scan.img", "scan.hdr.gz" and "scan.img.gz".
fs::path partner(const fs::path& path, const std::string& from, const std::string& to) {
  std::string name = path.filename().string();
  const std::size_t at = name.rfind(from);
  if (at == std::string::npos) return {};
  return path.parent_path() / name.replace(at, from.size(), to);
}

fs::path header_file(const fs::path& path) {
  const fs::path header = partner(path, ".img", ".hdr");
  return header.empty() ? path : header;
}

fs::path voxel_file(const fs::path& header) {
  const fs::path image = partner(header, ".hdr", ".img");
  if (image.empty())
    throw BadDataError(header, "is the header of a pair: name it .hdr, and its voxels .img");
  if (!fs::exists(image))
    throw NoInputError(header,
                       "keeps its voxels in an .img file of the same name, which is not "
                       "beside it; copy both");
  return image;
}

ByteStream opened(const fs::path& path) {
  const bool gzip = read_beginning(path, 2) == "\x1f\x8b";
  return ByteStream(path, gzip ? ByteStream::Coding::deflate : ByteStream::Coding::raw);
}

void set_dimensions(const NiftiHeader& header, Volume& volume) {
  const std::int64_t dimensions = header.dim[0];
  bool fit = dimensions >= 3 && dimensions <= 7;
  for (std::size_t i = 5; fit && i <= static_cast<std::size_t>(dimensions); ++i)
    fit = header.dim[i] == 1;
  if (!fit)
    throw BadDataError(header.name + ": has " + std::to_string(dimensions) +
                       " dimensions; a 3-D volume is needed, or several over time");
  set_size(volume, {header.dim[1], header.dim[2], header.dim[3]}, header.name);
}

std::string sizes_text(const Eigen::Vector3d& sizes) {
  return to_text(sizes.x(), 2) + " × " + to_text(sizes.y(), 2) + " × " + to_text(sizes.z(), 2);
}

// The sform's steps stand beside voxel sizes that the header tells again. Where they differ the
// standard lets the sform count; steps of 1 on all axes that differ have lost their size.
void compare_steps(const NiftiHeader& header, UnitAffine unit_affine, NiftiAffine& sform,
                   std::vector<std::string>& warnings) {
  constexpr double kAlike = 0.01, kOne = 1e-3;
  const Eigen::Vector3d steps = sform.axes.colwise().norm();
  const Eigen::Vector3d told =
      Eigen::Vector3d(header.pixdim[1], header.pixdim[2], header.pixdim[3]).cwiseAbs();
  double most = 0;
  bool lost = true;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(told[axis] > 0) || !std::isfinite(told[axis])) continue;
    const double apart = std::abs(steps[axis] / told[axis] - 1);
    most = std::max(most, apart);
    if (apart > kAlike) lost &= std::abs(steps[axis] - 1) < kOne;
  }
  if (!(most > kAlike)) return;
  const std::string both = "the NIfTI sform has voxels of " + sizes_text(steps) +
                           " where the header's voxel sizes (pixdim) are " + sizes_text(told);
  if (lost && unit_affine == UnitAffine::refuse)
    throw BadDataError(header.name + ": " + both +
                       ": it seems to have lost them. Write the file again with both alike, or "
                       "say which to take: --unit-affine scale takes pixdim's, --unit-affine keep "
                       "the sform's");
  const bool scales = lost && unit_affine == UnitAffine::scale;
  if (scales)
    for (int axis = 0; axis < 3; ++axis)
      if (told[axis] > 0 && std::isfinite(told[axis]))
        sform.axes.col(axis) *= told[axis] / steps[axis];
  warnings.push_back(both + ", which differ by up to " + percent(most) +
                     (scales ? "; pixdim's were taken, as asked for"
                             : "; the sform was taken, as the standard says"));
}

void place(const NiftiHeader& header, const VolumeReadOptions& options, Volume& volume,
           Shear& shear) {
  const bool has_qform = header.qform_code > 0, has_sform = header.sform_code > 0;
  NiftiAffine ras;
  if (has_sform) {
    ras = header.sform();
    compare_steps(header, options.unit_affine, ras, volume.warnings);
  } else if (has_qform) {
    ras = header.qform();
  } else {
    ras.axes = Eigen::Vector3d(header.pixdim[1], header.pixdim[2], header.pixdim[3]).asDiagonal();
    volume.warnings.push_back(
        "the NIfTI header has no position or orientation; voxel sizes alone were used, RAS");
  }
  if (has_sform && has_qform) {
    const NiftiAffine other = header.qform();
    const Eigen::Vector3d far(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
    const double apart =
        std::max((ras.origin - other.origin).norm(),
                 (ras.axes * far + ras.origin - other.axes * far - other.origin).norm());
    constexpr double kWorthTelling_mm = 0.5;
    if (apart > kWorthTelling_mm)
      volume.warnings.push_back("the NIfTI header's sform and qform differ by up to " +
                                to_text(apart, 1) + " mm; the sform was used");
  }
  const double unit = header.millimetres_per_unit();
  shear = set_grid_or_shear(volume, unit * lps_from_ras(ras.axes), unit * lps_from_ras(ras.origin),
                            header.name);
}

}  // namespace

Volume read_nifti(const fs::path& path, const VolumeReadOptions& options) {
  const fs::path header_path = header_file(path);
  ByteStream stream = opened(header_path);
  const NiftiHeader header(stream);
  const double least_offset = header.voxels_apart ? 0 : static_cast<double>(header.header_bytes);
  if (!(header.data_offset >= least_offset && header.data_offset < 1e9))
    throw BadDataError(path, "its voxels are said to start at byte " + to_text(header.data_offset));
  Volume volume;
  set_dimensions(header, volume);
  Shear shear;
  place(header, options, volume, shear);
  const TimePoints times = {header.time_points(), header.time_step()};
  volume.time_points = times.count;
  if (!header.voxels_apart) {
    std::uint64_t left = static_cast<std::uint64_t>(header.data_offset) - header.header_bytes;
    volume.label_names = read_nifti_labels(stream, left);
  }
  return read_one_of(times, options, header.name, [&](std::int64_t time) {
    if (options.grid_only && !shear) return volume;
    ByteStream voxels = opened(header.voxels_apart ? voxel_file(header_path) : header_path);
    voxels.skip(static_cast<std::uint64_t>(header.data_offset));
    const VoxelLayout layout = {
        .encoding = header.encoding(), .time = time, .times = times.count, .may_go_on = true};
    return decode_region(std::move(voxels), layout, options, shear, header.name, volume);
  });
}

}  // namespace organbake
