// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/nrrd_header.h"

#include "files/header_text.h"
#include "files/joined_bytes.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

ScalarType type_of(const NrrdHeader& header) {
  static const std::map<std::string, ScalarType> kTypes = {
      {"signed char", ScalarType::int8},
      {"int8", ScalarType::int8},
      {"int8_t", ScalarType::int8},
      {"uchar", ScalarType::uint8},
      {"unsigned char", ScalarType::uint8},
      {"uint8", ScalarType::uint8},
      {"uint8_t", ScalarType::uint8},
      {"short", ScalarType::int16},
      {"short int", ScalarType::int16},
      {"signed short", ScalarType::int16},
      {"signed short int", ScalarType::int16},
      {"int16", ScalarType::int16},
      {"int16_t", ScalarType::int16},
      {"ushort", ScalarType::uint16},
      {"unsigned short", ScalarType::uint16},
      {"unsigned short int", ScalarType::uint16},
      {"uint16", ScalarType::uint16},
      {"uint16_t", ScalarType::uint16},
      {"int", ScalarType::int32},
      {"signed int", ScalarType::int32},
      {"int32", ScalarType::int32},
      {"int32_t", ScalarType::int32},
      {"uint", ScalarType::uint32},
      {"unsigned int", ScalarType::uint32},
      {"uint32", ScalarType::uint32},
      {"uint32_t", ScalarType::uint32},
      {"longlong", ScalarType::int64},
      {"long long", ScalarType::int64},
      {"long long int", ScalarType::int64},
      {"signed long long", ScalarType::int64},
      {"signed long long int", ScalarType::int64},
      {"int64", ScalarType::int64},
      {"int64_t", ScalarType::int64},
      {"ulonglong", ScalarType::uint64},
      {"unsigned long long", ScalarType::uint64},
      {"unsigned long long int", ScalarType::uint64},
      {"uint64", ScalarType::uint64},
      {"uint64_t", ScalarType::uint64},
      {"float", ScalarType::float32},
      {"double", ScalarType::float64}};
  const auto type = kTypes.find(lower_case(header.get("type")));
  if (type == kTypes.end()) header.fail("type \"" + header.get("type") + "\" is not read");
  return type->second;
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

}  // namespace

NrrdHeader::NrrdHeader(const fs::path& path) : path_(path) {
  HeaderText text(path);
  std::string line;
  if (!text.next_line(line) || line.rfind("NRRD000", 0) != 0) fail("is not NRRD");
  // An empty line ends the header of an attached file; a detached header may end with the file.
  while (text.next_line(line) && !line.empty()) {
    if (line[0] == '#') continue;
    if (get(has("data file") ? "data file" : "datafile").rfind("LIST", 0) == 0) break;
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

std::string NrrdHeader::get(const std::string& field) const {
  const auto found = fields_.find(field);
  return found == fields_.end() ? std::string() : found->second;
}

std::string NrrdHeader::note(const std::string& key) const {
  const auto found = notes_.find(key);
  return found == notes_.end() ? std::string() : found->second;
}

std::int64_t NrrdHeader::integer(const std::string& field, std::int64_t otherwise) const {
  if (!has(field)) return otherwise;
  const auto values = integers(get(field), path_.string() + ": " + field);
  if (values.size() != 1) fail(field + " needs one number");
  return values[0];
}

VoxelEncoding NrrdHeader::encoding() const {
  const ScalarType type = type_of(*this);
  const std::string endian = lower_case(get("endian"));
  if (bytes_of(type) > 1 && !is_text() && endian != "little" && endian != "big") {
    fail("endian is \"" + endian + "\"; it must be little or big");
  }
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

std::vector<fs::path> NrrdHeader::data_files(const std::string& name) const {
  if (name.rfind("LIST", 0) != 0) {
    return name.find('%') == std::string::npos ? std::vector<fs::path>{}
                                               : files_of_pattern(name, path_);
  }
  // The names stand behind the field, a line each.
  std::vector<fs::path> files;
  HeaderText text(path_);
  bool behind = false;
  for (std::string line; text.next_line(line);) {
    if (behind && !trimmed(line).empty()) files.push_back(path_.parent_path() / trimmed(line));
    const std::string field = lower_case(line.substr(0, line.find(':')));
    behind |= field == "data file" || field == "datafile";
  }
  return files;
}

ByteStream NrrdHeader::open_data(std::uint64_t bytes) const {
  const std::string name = has("data file") ? get("data file") : get("datafile");
  const std::vector<fs::path> files = data_files(name);
  if (!files.empty()) {
    if (bytes % files.size() != 0 || has("line skip") || has("lineskip") || is_text()) {
      fail("spreads its voxels unevenly over " + std::to_string(files.size()) +
           " files; save it as one .nrrd");
    }
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

void NrrdHeader::fail(const std::string& message) const { throw BadDataError(path_, message); }

}  // namespace organbake
