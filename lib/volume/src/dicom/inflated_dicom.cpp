// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/inflated_dicom.h"

#include <sys/mman.h>
#include <unistd.h>
#include <zlib.h>

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPreamble = 132;
constexpr std::size_t kLongestMeta = 4096;
constexpr std::size_t kLargestInflated = std::size_t{1} << 28;  // of one slice
const std::string kDeflatedSyntax = "1.2.840.10008.1.2.1.99";
const std::string kExplicit = "1.2.840.10008.1.2.1";  // what it is once inflated

std::uint32_t number(const std::string& bytes, std::size_t at, int count) {
  std::uint32_t value = 0;
  for (int i = count - 1; i >= 0; --i)
    value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

// Where the data set begins, by the meta group's own length, its first element.
std::optional<std::size_t> end_of_meta(const std::string& bytes) {
  if (bytes.size() < kPreamble + 12 || bytes.compare(128, 4, "DICM") != 0) return std::nullopt;
  if (bytes.compare(kPreamble, 8, std::string("\2\0\0\0UL\4\0", 8)) != 0) return std::nullopt;
  const std::size_t end = kPreamble + 12 + number(bytes, kPreamble + 8, 4);
  return end <= bytes.size() ? std::optional(end) : std::nullopt;
}

std::optional<std::string> inflated(const std::string& bytes, std::size_t from) {
  z_stream stream{};
  constexpr int kRawDeflate = -MAX_WBITS;
  if (inflateInit2(&stream, kRawDeflate) != Z_OK) throw std::bad_alloc();
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + from));
  stream.avail_in = static_cast<uInt>(bytes.size() - from);
  std::string out, piece(std::size_t{1} << 18, '\0');
  int state = Z_OK;
  while (state == Z_OK && out.size() < kLargestInflated) {
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    state = inflate(&stream, Z_NO_FLUSH);
    out.append(piece, 0, piece.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  return state == Z_STREAM_END ? std::optional(std::move(out)) : std::nullopt;
}

std::string start_of(const fs::path& file) {
  std::string start(kLongestMeta, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(stream.gcount()));
  return start;
}

bool write_all(int descriptor, const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t written = ::write(descriptor, bytes.data() + at, bytes.size() - at);
    if (written <= 0) return false;
    at += static_cast<std::size_t>(written);
  }
  return true;
}

// The file with its data set inflated and its transfer syntax renamed; the shorter name is filled
// up with the zeros that UIDs are padded with.
std::optional<std::string> as_explicit(const fs::path& file) {
  const std::string start = start_of(file);
  if (start.find(kDeflatedSyntax) == std::string::npos) return std::nullopt;
  const auto meta = end_of_meta(start);
  if (!meta || start.find(kDeflatedSyntax) >= *meta) return std::nullopt;
  std::error_code error;
  if (fs::file_size(file, error) > kLargestInflated || error) return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(stream), {});
  auto data_set = inflated(bytes, *meta);
  if (!data_set) return std::nullopt;
  std::string head = bytes.substr(0, *meta);
  head.replace(head.find(kDeflatedSyntax), kDeflatedSyntax.size(),
               kExplicit + std::string(kDeflatedSyntax.size() - kExplicit.size(), '\0'));
  return head + *data_set;
}

}  // namespace

ReadableDicom::ReadableDicom(const fs::path& file) : path_(file) {
  const auto bytes = as_explicit(file);
  if (!bytes) return;
  memory_ = ::memfd_create("organbake-dicom", MFD_CLOEXEC);
  if (memory_ < 0 || !write_all(memory_, *bytes)) return;
  path_ = "/proc/self/fd/" + std::to_string(memory_);
}

ReadableDicom::~ReadableDicom() {
  if (memory_ >= 0) ::close(memory_);
}

}  // namespace organbake
