// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/vti_reader.h"

#include <algorithm>
#include <array>

#include "files/header_text.h"
#include "files/voxel_decoding.h"
#include "grid/affine_grid.h"
#include "grid/sheared_grid.h"
#include "organbake/core/error.h"
#include "organbake/formats/vtk_xml.h"

namespace organbake {
namespace {

// The active scalars, else the only array.
const VtkXmlArray& scalars_of(const VtkXmlPiece& piece, const VtkXmlFile& file) {
  const auto section = piece.sections.find("PointData");
  const VtkXmlArray* array = nullptr;
  if (section != piece.sections.end()) {
    const auto active = section->second.attributes.find("Scalars");
    if (active != section->second.attributes.end()) array = section->second.find(active->second);
    if (!array && section->second.arrays.size() == 1) array = &section->second.arrays[0];
  }
  if (!array) file.fail("has no point scalars");
  if (array->components != 1)
    file.fail("has " + std::to_string(array->components) + " values per voxel; one is needed");
  return *array;
}

// `count` numbers of an attribute; the given ones where it is not there.
template <std::size_t kCount>
std::array<double, kCount> attribute(const VtkXmlFile& file, const char* name,
                                     std::array<double, kCount> otherwise) {
  const auto found = file.attributes().find(name);
  if (found == file.attributes().end()) return otherwise;
  const std::vector<double> values = numbers(found->second, name);
  if (values.size() != kCount)
    file.fail(std::string(name) + " is \"" + found->second + "\"; " + std::to_string(kCount) +
              " numbers are needed");
  std::copy_n(values.begin(), kCount, otherwise.begin());
  return otherwise;
}

// First and last index along each axis.
std::array<std::int64_t, 6> extent_of(const XmlAttributes& attributes, const char* name,
                                      const VtkXmlFile& file) {
  const auto found = attributes.find(name);
  const std::vector<std::int64_t> values =
      found == attributes.end() ? std::vector<std::int64_t>() : integers(found->second, name);
  constexpr std::int64_t kFarthest = std::int64_t{1} << 31;
  const bool sound = values.size() == 6 && std::all_of(values.begin(), values.end(), [](auto i) {
                       return i > -kFarthest && i < kFarthest;
                     });
  if (!sound) file.fail(std::string("lacks a sound ") + name + " of six indices");
  std::array<std::int64_t, 6> extent;
  std::copy_n(values.begin(), 6, extent.begin());
  return extent;
}

Shear place(const VtkXmlFile& file, const std::array<std::int64_t, 6>& extent, Volume& volume,
            const std::string& name) {
  const auto spacing = attribute<3>(file, "Spacing", {1, 1, 1});
  const auto at = attribute<3>(file, "Origin", {0, 0, 0});
  const auto direction = attribute<9>(file, "Direction", {1, 0, 0, 0, 1, 0, 0, 0, 1});
  Eigen::Matrix3d axes;
  Eigen::Vector3d first, origin;
  std::array<std::int64_t, 3> size;
  for (int axis = 0; axis < 3; ++axis) {
    for (int row = 0; row < 3; ++row) axes(row, axis) = direction[3 * row + axis] * spacing[axis];
    size[axis] = extent[2 * axis + 1] - extent[2 * axis] + 1;
    first[axis] = static_cast<double>(extent[2 * axis]);
    origin[axis] = at[axis];
  }
  checked_voxel_count(size, name);
  for (int axis = 0; axis < 3; ++axis) volume.size[axis] = static_cast<int>(size[axis]);
  // VTK's origin is where index 0 would lie, even when the extent begins elsewhere.
  return set_grid_or_shear(volume, axes, origin + axes * first, name);
}

}  // namespace

Volume read_vti(const std::filesystem::path& path, const VolumeReadOptions& options) {
  const VtkXmlFile file(path, "ImageData");
  const VtkXmlPiece& piece = file.pieces().front();
  const auto extent = extent_of(piece.attributes, "Extent", file);
  if (file.pieces().size() > 1 || extent != extent_of(file.attributes(), "WholeExtent", file))
    file.fail("comes in several pieces; save it as one");
  Volume volume;
  const Shear shear = place(file, extent, volume, path.string());
  const VtkXmlArray& scalars = scalars_of(piece, file);
  const auto count = static_cast<std::size_t>(volume.size[0]) * volume.size[1] * volume.size[2];
  const VtkXmlNumbers values = file.numbers(scalars, count);
  const VoxelEncoding encoding{values.type, false, 1, 0};
  volume.voxels.resize(count);
  convert_voxels(values.bytes.data(), count, encoding, volume, 0);
  settle_values(volume, path.string());
  if (shear) return straightened(std::move(volume), shear, options, path.string());
  if (!options.region) return volume;
  const IndexBox box = voxels_of_region(volume, *options.region, path.string());
  return cropped(std::move(volume), box);
}

}  // namespace organbake
