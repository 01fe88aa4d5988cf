// SPDX-License-Identifier: GPL-3.0-or-later
// MetaImage (ITK's .mha and .mhd; documentation of MetaIO) in and out, and VTK's XML images (.vti,
// VTK file formats) in: where their voxels lie, and these as they are.
#include <zlib.h>
#include <algorithm>
#include <array>
#include <map>
#include <string>

#include "files/volume_files.h"
#include "grid/grids.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/vtk_xml.h"
#include "organbake/volume/read_volume.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

class MetaHeader : public HeaderFields {
 public:
  explicit MetaHeader(const fs::path& path) : HeaderFields(path) {
    HeaderText text(path);
    std::string line;
    // ElementDataFile is the last key by definition: the voxels may follow it.
    while (!has("elementdatafile") && text.next_line(line)) {
      const std::size_t equals = line.find('=');
      if (equals == std::string::npos) continue;
      fields_[lower_case(trimmed(line.substr(0, equals)))] = trimmed(line.substr(equals + 1));
    }
    if (!has("elementdatafile")) fail("has no ElementDataFile: not a MetaImage");
    data_offset_ = text.offset();
  }

  bool flag(const std::string& key) const { return lower_case(get(key)) == "true"; }
  // The first of several spellings that is there, as `count` numbers.
  std::vector<double> vector(std::initializer_list<const char*> spellings,
                             std::size_t count) const {
    for (const char* key : spellings) {
      if (!has(key)) continue;
      std::vector<double> values = numbers(get(key), place(key));
      if (values.size() != count)
        fail(std::string(key) + " needs " + std::to_string(count) + " numbers, not " +
             std::to_string(values.size()));
      return values;
    }
    return {};
  }
  std::uint64_t data_offset() const { return data_offset_; }

 private:
  std::uint64_t data_offset_ = 0;
};

VoxelEncoding encoding_of(const MetaHeader& header) {
  static const std::map<std::string, ScalarType> kTypes = {
      {"met_char", ScalarType::int8},       {"met_uchar", ScalarType::uint8},
      {"met_short", ScalarType::int16},     {"met_ushort", ScalarType::uint16},
      {"met_int", ScalarType::int32},       {"met_uint", ScalarType::uint32},
      {"met_long", ScalarType::int32},      {"met_ulong", ScalarType::uint32},
      {"met_long_long", ScalarType::int64}, {"met_ulong_long", ScalarType::uint64},
      {"met_float", ScalarType::float32},   {"met_double", ScalarType::float64}};
  const auto type = kTypes.find(lower_case(header.get("elementtype")));
  if (type == kTypes.end())
    header.fail("ElementType \"" + header.get("elementtype") + "\" is not a plain number");
  if (header.get("elementnumberofchannels", "1") != "1") header.fail("has several channels");
  return {type->second, header.flag("binarydatabyteordermsb") || header.flag("elementbyteordermsb"),
          1, 0};
}

// A fourth dimension is time: its sizes, spacings and directions lie behind those of space.
struct MetaGrid {
  std::size_t voxels = 0;
  std::int64_t times = 1;
  Shear shear;
};

MetaGrid place(const MetaHeader& header, Volume& volume) {
  const auto size = integers(header.get("dimsize"), header.place("DimSize"));
  const std::size_t dims = size.size();
  if (header.get("ndims", "3") != std::to_string(dims) || (dims != 3 && dims != 4))
    header.fail("has " + header.get("ndims", std::to_string(dims)) +
                " dimensions; a 3-D volume is needed");
  MetaGrid grid;
  grid.voxels = set_size(volume, {size[0], size[1], size[2]}, header.path().string());
  grid.times = dims == 4 ? size[3] : 1;

  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  const auto matrix = header.vector({"transformmatrix", "rotation", "orientation"}, dims * dims);
  for (std::size_t axis = 0; !matrix.empty() && axis < 3; ++axis)
    axes.col(static_cast<Eigen::Index>(axis)) =
        Eigen::Map<const Eigen::Vector3d>(&matrix[axis * dims]);
  const auto spacing = header.vector({"elementspacing", "elementsize"}, dims);
  if (spacing.empty()) {
    volume.warnings.push_back("the MetaImage header has no ElementSpacing; 1 mm was assumed");
  } else {
    axes = axes * Eigen::Map<const Eigen::Vector3d>(spacing.data()).asDiagonal();
  }
  const auto offset = header.vector({"offset", "position", "origin"}, dims);
  const Eigen::Vector3d origin =
      offset.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(offset[0], offset[1], offset[2]);
  grid.shear = set_grid_or_shear(volume, axes, origin, header.path().string());
  return grid;
}

// Where the voxels begin in a data file that may have a header of its own.
std::uint64_t after_own_header(const MetaHeader& header, const fs::path& file,
                               std::uint64_t voxel_bytes) {
  if (!header.has("headersize")) return 0;
  const auto skip = integers(header.get("headersize"), header.place("HeaderSize"));
  if (skip.size() != 1) header.fail("HeaderSize needs one number");
  if (skip[0] >= 0) return static_cast<std::uint64_t>(skip[0]);
  // −1: whatever stands before the last voxels is a header.
  const std::uint64_t all = ByteStream(file).most_possible_bytes();
  return all - std::min(all, voxel_bytes);
}

ByteStream open_parts(const MetaHeader& header, const std::string& name, ByteStream::Coding coding,
                      std::uint64_t voxel_bytes) {
  std::vector<VoxelPart> parts;
  const std::vector<fs::path> files = listed_files(name, header.path(), '=', {"elementdatafile"});
  if (files.empty() || voxel_bytes % files.size() != 0)
    header.fail("names " + std::to_string(files.size()) +
                " files, over which its voxels cannot be spread evenly");
  const std::uint64_t each = voxel_bytes / files.size();
  for (const fs::path& file : files) {
    parts.push_back({file, after_own_header(header, file, each)});
  }
  return joined_parts(std::move(parts), coding, each);
}

ByteStream open_data(const MetaHeader& header, std::uint64_t voxel_bytes) {
  const std::string name = header.get("elementdatafile");
  if (name.empty()) header.fail("ElementDataFile is empty");
  const auto coding =
      header.flag("compresseddata") ? ByteStream::Coding::deflate : ByteStream::Coding::raw;
  if (name.rfind("LIST", 0) == 0 || name.find('%') != std::string::npos)
    return open_parts(header, name, coding, voxel_bytes);
  if (lower_case(name) == "local") return ByteStream(header.path(), coding, header.data_offset());
  const fs::path file = header.path().parent_path() / name;
  return ByteStream(file, coding, after_own_header(header, file, voxel_bytes));
}

}  // namespace

Volume read_metaimage(const fs::path& path, const VolumeReadOptions& options) {
  const MetaHeader header(path);
  Volume volume;
  const MetaGrid grid = place(header, volume);
  const VoxelEncoding encoding = encoding_of(header);
  const bool is_text = lower_case(header.get("binarydata", "True")) == "false";
  volume.time_points = grid.times;
  const std::uint64_t bytes =
      grid.voxels * static_cast<std::uint64_t>(grid.times) * bytes_of(encoding.type);
  return read_one_of({grid.times, {}}, options, path.string(), [&](std::int64_t time) {
    return decode_region(open_data(header, bytes), {encoding, is_text, time, grid.times}, options,
                         grid.shear, path.string(), volume);
  });
}

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
  set_size(volume, size, name);
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
  const std::size_t count = IndexBox::whole(volume).voxels();
  const VtkXmlNumbers values = file.numbers(scalars, count);
  const VoxelEncoding encoding{values.type, false, 1, 0};
  volume.voxels.resize(count);
  convert_voxels(values.bytes.data(), count, encoding, volume, 0);
  settle_values(volume, path.string());
  return shear ? straightened(std::move(volume), shear, options, path.string())
               : within_region(std::move(volume), options, path.string());
}

namespace {

// CT noise packs hardly better at higher levels (3 % at 6), in a fifth of the time.
constexpr int kZlibLevel = 1;

std::string header_of(const Volume& volume, std::size_t packed_bytes) {
  std::string matrix, offset, spacing, size;
  for (int axis = 0; axis < 3; ++axis) {
    for (int row = 0; row < 3; ++row) matrix += " " + to_text(volume.direction(row, axis));
    offset += " " + to_text(volume.origin_mm[axis]);
    spacing += " " + to_text(volume.spacing_mm[axis]);
    size += " " + std::to_string(volume.size[axis]);
  }
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
         "CompressedData = True\nCompressedDataSize = " +
         std::to_string(packed_bytes) + "\nTransformMatrix =" + matrix + "\nOffset =" + offset +
         "\nCenterOfRotation = 0 0 0\nElementSpacing =" + spacing + "\nDimSize =" + size +
         "\nElementType = " + (volume.is_real() ? "MET_FLOAT" : "MET_SHORT") +
         "\nElementDataFile = LOCAL\n";
}

}  // namespace

void write_metaimage(const std::filesystem::path& path, const Volume& volume) {
  check_volume(volume, path.string());
  const auto voxels = with_values(volume, [](const auto values) { return std::as_bytes(values); });
  const uLong bytes = static_cast<uLong>(voxels.size());
  std::string packed(compressBound(bytes), '\0');
  uLongf packed_bytes = packed.size();
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &packed_bytes,
                reinterpret_cast<const Bytef*>(voxels.data()), bytes, kZlibLevel) != Z_OK)
    throw std::bad_alloc();
  packed.resize(packed_bytes);
  write_file_atomically(path, std::string_view(packed.insert(0, header_of(volume, packed_bytes))));
}

}  // namespace organbake
