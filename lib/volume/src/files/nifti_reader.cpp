// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/nifti_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>

#include "files/header_text.h"
#include "files/nifti_header.h"
#include "files/time_points.h"
#include "files/voxel_decoding.h"
#include "grid/affine_grid.h"
#include "grid/sheared_grid.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

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
    int label = 0;
    const char* first = xml.data() + key + kKey.size();
    const auto [end, error] = std::from_chars(first, xml.data() + close, label);
    const std::string name = element_text(xml, close + 1);
    if (error == std::errc() && end != first && label > 0 && !name.empty()) {
      names.push_back({label, name});
    }
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
  if (image.empty()) {
    throw BadDataError(header, "is the header of a pair: name it .hdr, and its voxels .img");
  }
  if (!fs::exists(image)) {
    throw NoInputError(header,
                       "keeps its voxels in an .img file of the same name, which is not "
                       "beside it; copy both");
  }
  return image;
}

ByteStream opened(const fs::path& path) {
  std::array<std::byte, 2> first{};
  ByteStream(path).read(first);
  const bool gzip = first[0] == std::byte{0x1f} && first[1] == std::byte{0x8b};
  return ByteStream(path, gzip ? ByteStream::Coding::deflate : ByteStream::Coding::raw);
}

void set_size(const NiftiHeader& header, Volume& volume) {
  const std::int64_t dimensions = header.dim[0];
  bool fit = dimensions >= 3 && dimensions <= 7;
  for (std::size_t i = 5; fit && i <= static_cast<std::size_t>(dimensions); ++i) {
    fit = header.dim[i] == 1;
  }
  if (!fit) {
    throw BadDataError(header.name + ": has " + std::to_string(dimensions) +
                       " dimensions; a 3-D volume is needed, or several over time");
  }
  checked_voxel_count({header.dim[1], header.dim[2], header.dim[3]}, header.name);
  for (std::size_t i = 0; i < 3; ++i) volume.size[i] = static_cast<int>(header.dim[i + 1]);
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
  if (lost && unit_affine == UnitAffine::refuse) {
    throw BadDataError(header.name + ": " + both +
                       ": it seems to have lost them. Write the file again with both alike, or "
                       "say which to take: --unit-affine scale takes pixdim's, --unit-affine keep "
                       "the sform's");
  }
  const bool scales = lost && unit_affine == UnitAffine::scale;
  if (scales) {
    for (int axis = 0; axis < 3; ++axis)
      if (told[axis] > 0 && std::isfinite(told[axis]))
        sform.axes.col(axis) *= told[axis] / steps[axis];
  }
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
    if (apart > kWorthTelling_mm) {
      volume.warnings.push_back("the NIfTI header's sform and qform differ by up to " +
                                to_text(apart, 1) + " mm; the sform was used");
    }
  }
  const double unit = header.millimetres_per_unit();
  shear = set_grid_or_shear(volume, unit * lps_from_ras(ras.axes), unit * lps_from_ras(ras.origin),
                            header.name);
}

struct PlacedGrid {
  const Volume& grid;
  const Shear& shear;
};

Volume read_one(const NiftiHeader& header, const fs::path& header_path, const PlacedGrid& placed,
                std::int64_t time, const VolumeReadOptions& options) {
  if (options.grid_only && !placed.shear) return placed.grid;
  ByteStream stream = opened(header.voxels_apart ? voxel_file(header_path) : header_path);
  const VoxelEncoding encoding = header.encoding();
  const auto& [nx, ny, nz] = placed.grid.size;
  const std::uint64_t voxels = static_cast<std::uint64_t>(nx) * static_cast<std::uint64_t>(ny) *
                               static_cast<std::uint64_t>(nz);
  stream.skip(static_cast<std::uint64_t>(header.data_offset) +
              static_cast<std::uint64_t>(time) * voxels * bytes_of(encoding.type));
  Volume volume = placed.grid;
  if (options.region && !placed.shear) {
    const IndexBox box = voxels_of_region(volume, *options.region, header.name);
    decode_box(stream, encoding, box, volume);
    return volume;
  }
  decode_voxels(stream, encoding, volume);
  // Reading past the voxels makes the decompressor check its sum over all that came before.
  std::byte beyond;
  if (time + 1 == header.time_points()) stream.read({&beyond, 1});
  return straightened(std::move(volume), placed.shear, options, header.name);
}

}  // namespace

Volume read_nifti(const fs::path& path, const VolumeReadOptions& options) {
  const fs::path header_path = header_file(path);
  ByteStream stream = opened(header_path);
  const NiftiHeader header(stream);
  const double least_offset = header.voxels_apart ? 0 : static_cast<double>(header.header_bytes);
  if (!(header.data_offset >= least_offset && header.data_offset < 1e9)) {
    throw BadDataError(path, "its voxels are said to start at byte " + to_text(header.data_offset));
  }
  Volume volume;
  set_size(header, volume);
  Shear shear;
  place(header, options, volume, shear);
  const TimePoints times = {header.time_points(), header.time_step()};
  volume.time_points = times.count;
  if (!header.voxels_apart) {
    std::uint64_t left = static_cast<std::uint64_t>(header.data_offset) - header.header_bytes;
    volume.label_names = read_nifti_labels(stream, left);
  }
  return read_one_of(times, options, header.name, [&](std::int64_t time) {
    return read_one(header, header_path, {volume, shear}, time, options);
  });
}

}  // namespace organbake
