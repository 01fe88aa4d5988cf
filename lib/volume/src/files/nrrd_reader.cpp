// SPDX-License-Identifier: GPL-3.0-or-later
// Reads NRRD (Teem's definition of the format, versions 1 to 5) with its voxels attached, apart or
// in several files, and the layers of 3D Slicer's segmentations (.seg.nrrd).
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "files/volume_files.h"
#include "grid/grids.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// The fields of a NRRD header, and what they mean for reading the voxels.
class NrrdHeader : public HeaderFields {
 public:
  explicit NrrdHeader(const fs::path& path);

  // A note ("key:=value"), to which the standard gives no meaning, but some programs do; empty when
  // it is missing. Its key keeps its case.
  std::string note(const std::string& key) const;
  int note_number(const std::string& key, int otherwise) const;

  VoxelEncoding encoding() const;
  bool is_text() const;
  // Opens the data, wherever it is, at its first voxel; `bytes` = what the voxels take.
  ByteStream open_data(std::uint64_t bytes) const;

 private:
  ByteStream::Coding coding() const;

  std::map<std::string, std::string> notes_;
  std::uint64_t data_offset_ = 0;
};

// The names that the standard gives each type.
ScalarType type_of(const NrrdHeader& header) {
  static const std::pair<ScalarType, std::vector<const char*>> kNames[] = {
      {ScalarType::int8, {"signed char", "int8", "int8_t"}},
      {ScalarType::uint8, {"uchar", "unsigned char", "uint8", "uint8_t"}},
      {ScalarType::int16,
       {"short", "short int", "signed short", "signed short int", "int16", "int16_t"}},
      {ScalarType::uint16,
       {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}},
      {ScalarType::int32, {"int", "signed int", "int32", "int32_t"}},
      {ScalarType::uint32, {"uint", "unsigned int", "uint32", "uint32_t"}},
      {ScalarType::int64,
       {"longlong", "long long", "long long int", "signed long long", "signed long long int",
        "int64", "int64_t"}},
      {ScalarType::uint64,
       {"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"}},
      {ScalarType::float32, {"float"}},
      {ScalarType::float64, {"double"}}};
  const std::string written = lower_case(header.get("type"));
  for (const auto& [type, names] : kNames)
    if (std::find(names.begin(), names.end(), written) != names.end()) return type;
  header.fail("type \"" + header.get("type") + "\" is not read");
}

// A `line skip` counts lines of the data file as it lies on disk, before any decompression.
std::uint64_t after_lines(const fs::path& file, std::uint64_t offset, std::int64_t lines) {
  ByteStream stream(file, ByteStream::Coding::raw, offset);
  std::byte byte;
  while (lines > 0) {
    stream.read_exactly({&byte, 1});
    ++offset;
    lines -= byte == std::byte{'\n'};
  }
  return offset;
}

NrrdHeader::NrrdHeader(const fs::path& path) : HeaderFields(path) {
  HeaderText text(path);
  std::string line;
  if (!text.next_line(line) || line.rfind("NRRD000", 0) != 0) fail("is not NRRD");
  // An empty line ends the header of an attached file; a detached header may end with the file.
  while (text.next_line(line) && !line.empty()) {
    if (line[0] == '#') continue;
    if (get("data file", get("datafile")).starts_with("LIST")) break;
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) fail("header line \"" + line.substr(0, 80) + "\" has no colon");
    if (line.compare(colon, 2, ":=") == 0) {
      notes_[line.substr(0, colon)] = trimmed(line.substr(colon + 2));
      continue;
    }
    fields_[lower_case(trimmed(line.substr(0, colon)))] = trimmed(line.substr(colon + 1));
  }
  data_offset_ = text.offset();
}

std::string NrrdHeader::note(const std::string& key) const {
  const auto found = notes_.find(key);
  return found == notes_.end() ? std::string() : found->second;
}

int NrrdHeader::note_number(const std::string& key, int otherwise) const {
  const std::string text = note(key);
  return text.empty() ? otherwise : static_cast<int>(one_integer(text, key));
}

VoxelEncoding NrrdHeader::encoding() const {
  const ScalarType type = type_of(*this);
  const std::string endian = lower_case(get("endian"));
  if (bytes_of(type) > 1 && !is_text() && endian != "little" && endian != "big")
    fail("endian is \"" + endian + "\"; it must be little or big");
  return {type, endian == "big", 1, 0};
}

bool NrrdHeader::is_text() const {
  const std::string encoding = lower_case(get("encoding"));
  return encoding == "ascii" || encoding == "text" || encoding == "txt";
}

ByteStream::Coding NrrdHeader::coding() const {
  const std::string encoding = lower_case(get("encoding"));
  if (encoding == "raw" || is_text()) return ByteStream::Coding::raw;
  if (encoding == "gzip" || encoding == "gz") return ByteStream::Coding::deflate;
  if (encoding == "bzip2" || encoding == "bz2") return ByteStream::Coding::bzip2;
  fail("encoding \"" + encoding + "\" is not read; use raw, gzip, bzip2 or ascii");
}

ByteStream NrrdHeader::open_data(std::uint64_t bytes) const {
  const std::string name = get("data file", get("datafile"));
  std::vector<fs::path> files;  // that the voxels are spread over; none when they lie in one
  if (name.starts_with("LIST") || name.find('%') != name.npos)
    files = listed_files(name, path_, ':', {"data file", "datafile"});
  if (!files.empty()) {
    if (bytes % files.size() != 0 || has("line skip") || has("lineskip") || is_text())
      fail("spreads its voxels unevenly over " + std::to_string(files.size()) +
           " files; save it as one .nrrd");
    const std::int64_t before = integer("byte skip", integer("byteskip", 0));
    if (before < 0) fail("a byte skip of " + std::to_string(before) + " over several files");
    std::vector<VoxelPart> parts;
    for (const fs::path& file : files) parts.push_back({file, static_cast<std::uint64_t>(before)});
    return joined_parts(std::move(parts), coding(), bytes / files.size());
  }
  const fs::path file = name.empty() ? path_ : path_.parent_path() / name;
  std::uint64_t offset = name.empty() ? data_offset_ : 0;
  const std::int64_t lines = integer("line skip", integer("lineskip", 0));
  const std::int64_t skip = integer("byte skip", integer("byteskip", 0));
  if (lines < 0 || skip < -1) fail("a skip of " + std::to_string(std::min(lines, skip)));
  offset = after_lines(file, offset, lines);
  ByteStream stream(file, coding(), offset);
  if (skip >= 0) {
    stream.skip(static_cast<std::uint64_t>(skip));
    return stream;
  }
  // −1: the voxels are the last bytes. Compressed data must be measured to know where they begin.
  std::uint64_t length = stream.most_possible_bytes();
  if (coding() != ByteStream::Coding::raw) {
    length = 0;
    std::vector<std::byte> scrap(std::size_t{1} << 16);
    for (std::size_t got; (got = stream.read(scrap)) > 0;) length += got;
  }
  if (length < bytes)
    throw BadDataError(file, "truncated: it holds fewer bytes than voxels ask for");
  ByteStream again(file, coding(), offset);
  again.skip(length - bytes);
  return again;
}

using AxisVector = std::optional<Eigen::Vector3d>;  // nothing for an axis that is not in space

// "(1,0,0) (0,1,0) none (0,0,1)"
std::vector<AxisVector> space_directions(const NrrdHeader& header) {
  const std::string text = header.get("space directions");
  std::vector<AxisVector> directions;
  for (std::size_t at = 0; (at = text.find_first_not_of(" \t", at)) != std::string::npos;) {
    if (text[at] != '(') {
      directions.push_back(std::nullopt);  // "none"
      at = std::min(text.find_first_of(" \t", at), text.size());
      continue;
    }
    const std::size_t close = text.find(')', at);
    if (close == std::string::npos) header.fail("space directions lack a bracket");
    const auto values = numbers(text.substr(at, close + 1 - at), header.place("space directions"));
    if (values.size() != 3) header.fail("space directions need three numbers each");
    directions.push_back(Eigen::Vector3d(values[0], values[1], values[2]));
    at = close + 1;
  }
  return directions;
}

// The three axes that span the volume, and the one of several volumes: segments that overlap, or
// times.
struct NrrdAxes {
  std::vector<std::size_t> in_space;
  std::int64_t volumes = 1;
  bool interleaved = false;  // the volumes' axis is the fastest
};

NrrdAxes axes_of(const NrrdHeader& header, const std::vector<std::int64_t>& sizes,
                 const std::vector<AxisVector>& directions) {
  const std::string dimensions = "has " + std::to_string(sizes.size()) + " dimensions; ";
  if (!directions.empty() && directions.size() != sizes.size())
    header.fail("has " + std::to_string(sizes.size()) + " sizes but " +
                std::to_string(directions.size()) + " space directions");
  NrrdAxes axes;
  std::size_t extra = sizes.size();
  for (std::size_t i = 0, dropped = 0; i < sizes.size(); ++i) {
    const bool spare = dropped + 3 < sizes.size();
    const bool drop = spare && (directions.empty() ? sizes[i] == 1 : !directions[i]);
    dropped += drop;
    if (!drop) {
      axes.in_space.push_back(i);
    } else if (sizes[i] != 1) {
      if (axes.volumes != 1) header.fail(dimensions + "a 3-D volume is needed");
      axes.volumes = sizes[i];
      extra = i;
    }
  }
  // Without directions the last of four is time, as programs write it.
  if (directions.empty() && axes.in_space.size() == 4) {
    extra = 3;
    axes.volumes = sizes[3];
    axes.in_space.pop_back();
  }
  std::size_t with_direction = 0;
  for (const AxisVector& direction : directions) with_direction += direction.has_value();
  if (axes.in_space.size() != 3 || (!directions.empty() && with_direction != 3))
    header.fail(dimensions + "a 3-D volume is needed");
  if (axes.volumes != 1 && extra != 0 && extra + 1 != sizes.size())
    header.fail("has its volumes along axis " + std::to_string(extra) +
                "; the first or the last is needed");
  axes.interleaved = axes.volumes != 1 && extra == 0;
  return axes;
}

// Diagonal that turns the file's world into LPS.
Eigen::Vector3d lps_from_space(const NrrdHeader& header, Volume& volume) {
  const std::string space = lower_case(header.get("space"));
  if (space == "left-posterior-superior" || space == "lps") return {1, 1, 1};
  if (space == "right-anterior-superior" || space == "ras") return {-1, -1, 1};
  if (space == "left-anterior-superior" || space == "las") return {1, -1, 1};
  volume.warnings.push_back("the NRRD header's space \"" + space +
                            "\" does not tell left from right; LPS was assumed");
  return {1, 1, 1};
}

void check_units(const NrrdHeader& header) {
  const std::string units = lower_case(header.get("space units"));
  if (units.empty() || units.find("\"mm\"") != std::string::npos) return;
  header.fail("space units " + units + "; millimetres are needed");
}

Eigen::Matrix3d axes_without_directions(const NrrdHeader& header,
                                        const std::vector<std::size_t>& axes, Volume& volume) {
  const auto spacings = numbers(header.get("spacings"), header.place("spacings"));
  if (spacings.empty()) {
    volume.warnings.push_back("the NRRD header has no spacings; 1 mm was assumed");
    return Eigen::Matrix3d::Identity();
  }
  if (spacings.size() <= axes.back()) header.fail("has fewer spacings than sizes");
  return Eigen::Vector3d(spacings[axes[0]], spacings[axes[1]], spacings[axes[2]]).asDiagonal();
}

NrrdAxes place(const NrrdHeader& header, Volume& volume, Shear& shear) {
  const std::string name = header.path().string();
  const auto sizes = integers(header.get("sizes"), header.place("sizes"));
  if (static_cast<std::int64_t>(sizes.size()) != header.integer("dimension", -1))
    header.fail("has " + std::to_string(sizes.size()) + " sizes for dimension " +
                header.get("dimension"));
  const std::vector<AxisVector> directions = space_directions(header);
  const NrrdAxes all = axes_of(header, sizes, directions);
  const std::vector<std::size_t>& axes = all.in_space;
  set_size(volume, {sizes[axes[0]], sizes[axes[1]], sizes[axes[2]]}, name);
  check_units(header);

  Eigen::Matrix3d columns;
  if (directions.empty()) columns = axes_without_directions(header, axes, volume);
  for (int i = 0; i < 3 && !directions.empty(); ++i) columns.col(i) = *directions[axes[i]];
  const auto origin = numbers(header.get("space origin"), header.place("space origin"));
  if (!origin.empty() && origin.size() != 3) header.fail("space origin needs three numbers");
  const Eigen::Vector3d lps = lps_from_space(header, volume);
  const Eigen::Vector3d at =
      origin.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(origin[0], origin[1], origin[2]);
  shear = set_grid_or_shear(volume, lps.asDiagonal() * columns, lps.cwiseProduct(at), name);
  return all;
}

// 3D Slicer's segments: "Segment0_Name:=liver", "Segment0_LabelValue:=1", "Segment0_Layer:=0".
std::vector<LabelName> segments_of(const NrrdHeader& header) {
  std::vector<LabelName> names;
  for (int i = 0;; ++i) {
    const std::string segment = "Segment" + std::to_string(i) + "_";
    std::string name = header.note(segment + "Name");
    if (name.empty()) name = header.note(segment + "ID");
    if (name.empty()) return names;
    names.push_back({header.note_number(segment + "LabelValue", i + 1), name,
                     header.note_number(segment + "Layer", 0)});
  }
}

}  // namespace

Volume read_nrrd(const std::filesystem::path& path, const VolumeReadOptions& options) {
  const NrrdHeader header(path);
  Volume volume;
  Shear shear;
  const NrrdAxes axes = place(header, volume, shear);
  volume.label_names = segments_of(header);
  const VoxelEncoding encoding = header.encoding();
  const std::uint64_t bytes = IndexBox::whole(volume).voxels() *
                              static_cast<std::uint64_t>(axes.volumes) * bytes_of(encoding.type);
  const auto read_one = [&](std::int64_t which) {
    return decode_region(header.open_data(bytes),
                         {encoding, header.is_text(), which, axes.volumes, axes.interleaved},
                         options, shear, path.string(), volume);
  };
  // Layers of one segmentation are not times: they lie over one another, and labels choose.
  if (!volume.label_names.empty() && axes.volumes > 1)
    return read_layers(axes.volumes, options, path.string(), volume.label_names, read_one);
  volume.time_points = axes.volumes;
  return read_one_of({axes.volumes, {}}, options, path.string(), read_one);
}

}  // namespace organbake
