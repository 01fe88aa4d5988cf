// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/metaimage_reader.h"

#include <algorithm>
#include <map>

#include "core/error.h"
#include "volume/grid.h"
#include "volume/header_text.h"
#include "volume/voxel_decoding.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

class MetaHeader {
 public:
  explicit MetaHeader(const fs::path& path) : path_(path), text_(path) {
    std::string line;
    // ElementDataFile is the last key by definition: the voxels may follow it.
    while (!has("elementdatafile") && text_.next_line(line)) {
      const std::size_t equals = line.find('=');
      if (equals == std::string::npos) continue;
      keys_[lower_case(trimmed(line.substr(0, equals)))] = trimmed(line.substr(equals + 1));
    }
    if (!has("elementdatafile")) fail("has no ElementDataFile: not a MetaImage");
  }

  bool has(const std::string& key) const { return keys_.count(key) > 0; }
  std::string get(const std::string& key, const std::string& otherwise = {}) const {
    const auto found = keys_.find(key);
    return found == keys_.end() ? otherwise : found->second;
  }
  bool flag(const std::string& key) const { return lower_case(get(key)) == "true"; }
  // The first of several spellings that is there, as `count` numbers.
  std::vector<double> vector(std::initializer_list<const char*> spellings,
                             std::size_t count) const {
    for (const char* key : spellings) {
      if (!has(key)) continue;
      std::vector<double> values = numbers(get(key), path_.string() + ": " + key);
      if (values.size() != count)
        fail(std::string(key) + " needs " + std::to_string(count) + " numbers, not " +
             std::to_string(values.size()));
      return values;
    }
    return {};
  }
  std::uint64_t data_offset() const { return text_.offset(); }
  const fs::path& path() const { return path_; }
  [[noreturn]] void fail(const std::string& message) const { throw BadDataError(path_, message); }

 private:
  fs::path path_;
  HeaderText text_;
  std::map<std::string, std::string> keys_;
};

VoxelEncoding encoding_of(const MetaHeader& header) {
  static const std::map<std::string, VoxelType> kTypes = {
      {"met_char", VoxelType::int8},       {"met_uchar", VoxelType::uint8},
      {"met_short", VoxelType::int16},     {"met_ushort", VoxelType::uint16},
      {"met_int", VoxelType::int32},       {"met_uint", VoxelType::uint32},
      {"met_long", VoxelType::int32},      {"met_ulong", VoxelType::uint32},
      {"met_long_long", VoxelType::int64}, {"met_ulong_long", VoxelType::uint64},
      {"met_float", VoxelType::float32},   {"met_double", VoxelType::float64}};
  const auto type = kTypes.find(lower_case(header.get("elementtype")));
  if (type == kTypes.end())
    header.fail("ElementType \"" + header.get("elementtype") + "\" is not a plain number");
  if (header.get("elementnumberofchannels", "1") != "1") header.fail("has several channels");
  return {type->second, header.flag("binarydatabyteordermsb") || header.flag("elementbyteordermsb"),
          1, 0};
}

// Sets the grid and returns the number of voxels.
std::size_t place(const MetaHeader& header, Volume& volume) {
  const auto size = integers(header.get("dimsize"), header.path().string() + ": DimSize");
  if (header.get("ndims", "3") != "3" || size.size() != 3) {
    header.fail("has " + header.get("ndims", std::to_string(size.size())) +
                " dimensions; a 3-D volume is needed");
  }
  const std::size_t count =
      checked_voxel_count({size[0], size[1], size[2]}, header.path().string());
  for (int i = 0; i < 3; ++i) volume.size[i] = static_cast<int>(size[i]);

  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  const auto matrix = header.vector({"transformmatrix", "rotation", "orientation"}, 9);
  if (!matrix.empty()) axes = Eigen::Map<const Eigen::Matrix3d>(matrix.data());
  const auto spacing = header.vector({"elementspacing", "elementsize"}, 3);
  if (spacing.empty()) {
    volume.warnings.push_back("the MetaImage header has no ElementSpacing; 1 mm was assumed");
  } else {
    axes = axes * Eigen::Map<const Eigen::Vector3d>(spacing.data()).asDiagonal();
  }
  const auto offset = header.vector({"offset", "position", "origin"}, 3);
  const Eigen::Vector3d origin =
      offset.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(offset[0], offset[1], offset[2]);
  set_grid(volume, axes, origin, header.path().string());
  return count;
}

// Where the voxels begin in a data file that may have a header of its own.
std::uint64_t after_own_header(const MetaHeader& header, const fs::path& file,
                               std::uint64_t voxel_bytes) {
  if (!header.has("headersize")) return 0;
  const auto skip = integers(header.get("headersize"), header.path().string() + ": HeaderSize");
  if (skip.size() != 1) header.fail("HeaderSize needs one number");
  if (skip[0] >= 0) return static_cast<std::uint64_t>(skip[0]);
  // −1: whatever stands before the last voxels is a header.
  const std::uint64_t all = ByteStream(file).most_possible_bytes();
  return all - std::min(all, voxel_bytes);
}

ByteStream open_data(const MetaHeader& header, std::uint64_t voxel_bytes) {
  const std::string name = header.get("elementdatafile");
  if (name.empty()) header.fail("ElementDataFile is empty");
  if (name.rfind("LIST", 0) == 0 || name.find('%') != std::string::npos) {
    header.fail("spreads its voxels over several files; save it as one .mha");
  }
  const auto coding =
      header.flag("compresseddata") ? ByteStream::Coding::deflate : ByteStream::Coding::raw;
  if (lower_case(name) == "local") return ByteStream(header.path(), coding, header.data_offset());
  const fs::path file = header.path().parent_path() / name;
  return ByteStream(file, coding, after_own_header(header, file, voxel_bytes));
}

}  // namespace

Volume read_metaimage(const fs::path& path, const VolumeReadOptions& options) {
  const MetaHeader header(path);
  Volume volume;
  const std::size_t count = place(header, volume);
  const VoxelEncoding encoding = encoding_of(header);
  ByteStream stream = open_data(header, count * bytes_of(encoding.type));
  const bool is_text = lower_case(header.get("binarydata", "True")) == "false";
  return decode_region(stream, encoding, is_text, options.region, path.string(), std::move(volume));
}

}  // namespace organbake
