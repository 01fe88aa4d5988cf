// SPDX-License-Identifier: GPL-3.0-or-later
// Bytes of files: plain, or packed by zlib or bzip2, of one file or of several that follow one
// another, never more than the file can hold.
#include <bzlib.h>
#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "files/volume_files.h"
#include "organbake/core/error.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 18;
// Deflate's largest ratio is 1032; the slack covers headers. bzip2 packs runs far tighter.
constexpr std::uint64_t kDeflateRatio = 1040;
constexpr std::uint64_t kBzip2Ratio = 200000;

// No buffer of its own: it asks the system for what its users want, and nothing beyond.
class FileSource : public ByteSource {
 public:
  FileSource(const fs::path& file, std::uint64_t offset)
      : file_(file), bytes_(fs::file_size(file)), at_(offset) {
    descriptor_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ < 0)
      throw NoInputError(file, std::string("cannot be opened: ") + std::strerror(errno));
  }
  ~FileSource() override { ::close(descriptor_); }
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::size_t read(std::span<std::byte> out) override {
    const std::size_t done = read_ahead(0, out);
    at_ += done;
    return done;
  }
  std::size_t read_ahead(std::uint64_t ahead, std::span<std::byte> out) const override {
    const std::uint64_t from = at_ + ahead;
    std::size_t done = 0;
    // A lying header may have led beyond the end, even to where no offset is possible.
    while (done < out.size() && from < bytes_) {
      const ssize_t got = ::pread(descriptor_, out.data() + done, out.size() - done,
                                  static_cast<off_t>(from + done));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) throw IoError::reading(file_, std::strerror(errno));
      if (got == 0) break;
      done += static_cast<std::size_t>(got);
    }
    return done;
  }
  bool reads_ahead() const override { return true; }
  std::uint64_t skip(std::uint64_t count) override {
    const std::uint64_t skipped = std::min(count, bytes_ - std::min(bytes_, at_));
    at_ += skipped;
    return skipped;
  }

 private:
  fs::path file_;
  std::uint64_t bytes_, at_;
  int descriptor_ = -1;
};

// What both decompressors share: a chunk of compressed input, refilled when it is used up.
class Decompressor : public ByteSource {
 public:
  Decompressor(const fs::path& file, std::uint64_t offset)
      : file_(file), input_(file, offset), chunk_(kChunk) {}

  std::size_t read(std::span<std::byte> out) final {
    std::size_t done = 0;
    while (done < out.size() && !ended_) {
      if (packed_.empty() && !refill()) damaged();
      constexpr std::size_t kMostAtOnce = std::size_t{1} << 30;  // the libraries count in 32 bits
      done += unpack(packed_, out.subspan(done, std::min(out.size() - done, kMostAtOnce)));
    }
    return done;
  }

 protected:
  // Takes bytes off the front of `packed`, and returns how many it made of them; end() at the end.
  virtual std::size_t unpack(std::span<std::byte>& packed, std::span<std::byte> out) = 0;

  [[noreturn]] void damaged() const {
    throw BadDataError(file_, "its compressed data is damaged or truncated");
  }
  bool refill() {
    packed_ = std::span(chunk_).first(input_.read(chunk_));
    return !packed_.empty();
  }
  void end() { ended_ = true; }

 private:
  fs::path file_;
  FileSource input_;
  std::vector<std::byte> chunk_;
  std::span<std::byte> packed_;
  bool ended_ = false;
};

class InflateSource : public Decompressor {
 public:
  InflateSource(const fs::path& file, std::uint64_t offset) : Decompressor(file, offset) {
    constexpr int kGzipOrZlib = 32 + MAX_WBITS;
    if (inflateInit2(&z_, kGzipOrZlib) != Z_OK) throw std::bad_alloc();
  }
  ~InflateSource() override { inflateEnd(&z_); }

 private:
  std::size_t unpack(std::span<std::byte>& packed, std::span<std::byte> out) override {
    z_.next_in = reinterpret_cast<Bytef*>(packed.data());
    z_.avail_in = static_cast<uInt>(packed.size());
    z_.next_out = reinterpret_cast<Bytef*>(out.data());
    z_.avail_out = static_cast<uInt>(out.size());
    const int result = inflate(&z_, Z_NO_FLUSH);
    packed = packed.last(z_.avail_in);
    if (result == Z_STREAM_END) {
      // gzip files may be several members one after the other (pigz, bgzip). What follows the last
      // member and is not another one is padding.
      constexpr std::byte kGzipMagic{0x1f};
      const bool more = (!packed.empty() || refill()) && packed.front() == kGzipMagic;
      more ? static_cast<void>(inflateReset(&z_)) : end();
    } else if (result != Z_OK) {
      damaged();
    }
    return out.size() - z_.avail_out;
  }

  z_stream z_{};
};

class Bunzip2Source : public Decompressor {
 public:
  Bunzip2Source(const fs::path& file, std::uint64_t offset) : Decompressor(file, offset) {
    if (BZ2_bzDecompressInit(&bz_, 0, 0) != BZ_OK) throw std::bad_alloc();
  }
  ~Bunzip2Source() override { BZ2_bzDecompressEnd(&bz_); }

 private:
  std::size_t unpack(std::span<std::byte>& packed, std::span<std::byte> out) override {
    bz_.next_in = reinterpret_cast<char*>(packed.data());
    bz_.avail_in = static_cast<unsigned>(packed.size());
    bz_.next_out = reinterpret_cast<char*>(out.data());
    bz_.avail_out = static_cast<unsigned>(out.size());
    const int result = BZ2_bzDecompress(&bz_);
    packed = packed.last(bz_.avail_in);
    if (result == BZ_STREAM_END) {
      end();
    } else if (result != BZ_OK) {
      damaged();
    }
    return out.size() - bz_.avail_out;
  }

  bz_stream bz_{};
};

}  // namespace

std::uint64_t ByteSource::skip(std::uint64_t count) {
  std::vector<std::byte> scrap(static_cast<std::size_t>(std::min<std::uint64_t>(count, kChunk)));
  std::uint64_t skipped = 0;
  while (skipped < count) {
    const std::size_t piece = std::min<std::uint64_t>(count - skipped, scrap.size());
    const std::size_t got = read(std::span(scrap).first(piece));
    skipped += got;
    if (got < piece) break;
  }
  return skipped;
}

ByteStream::ByteStream(const fs::path& file, Coding coding, std::uint64_t offset) : file_(file) {
  std::error_code error;
  if (fs::is_directory(file, error)) throw NoInputError(file, "is a folder, a file is needed");
  const std::uint64_t bytes = fs::file_size(file, error);
  if (error) throw NoInputError(file, "cannot be opened: " + error.message());
  const std::uint64_t left = bytes - std::min<std::uint64_t>(bytes, offset);
  if (coding == Coding::raw) source_ = std::make_unique<FileSource>(file, offset);
  if (coding == Coding::deflate) source_ = std::make_unique<InflateSource>(file, offset);
  if (coding == Coding::bzip2) source_ = std::make_unique<Bunzip2Source>(file, offset);
  const std::uint64_t most_ratio = coding == Coding::raw       ? 1
                                   : coding == Coding::deflate ? kDeflateRatio
                                                               : kBzip2Ratio;
  most_possible_bytes_ = left * most_ratio;
}

ByteStream::ByteStream(fs::path file, std::unique_ptr<ByteSource> source,
                       std::uint64_t most_possible_bytes)
    : file_(std::move(file)),
      source_(std::move(source)),
      most_possible_bytes_(most_possible_bytes) {}

void ByteStream::read_exactly(std::span<std::byte> out) {
  if (read(out) < out.size()) fail_truncated();
}

void ByteStream::read_ahead(std::uint64_t bytes, std::span<std::byte> out) const {
  if (source_->read_ahead(bytes, out) < out.size()) fail_truncated();
}

void ByteStream::skip(std::uint64_t count) {
  if (source_->skip(count) < count) fail_truncated();
}

void ByteStream::fail_truncated() const {
  throw BadDataError(file_, "truncated: the data ends too early");
}

namespace {

constexpr std::int64_t kMostParts = 65535;

class PartsSource : public ByteSource {
 public:
  PartsSource(std::vector<VoxelPart> parts, ByteStream::Coding coding, std::uint64_t bytes_each)
      : parts_(std::move(parts)), coding_(coding), bytes_each_(bytes_each) {}

  std::size_t read(std::span<std::byte> out) override {
    std::size_t done = 0;
    while (done < out.size() && (left_ > 0 || open_next())) {
      const auto piece =
          static_cast<std::size_t>(std::min<std::uint64_t>(out.size() - done, left_));
      current_->read_exactly(out.subspan(done, piece));
      done += piece;
      left_ -= piece;
    }
    return done;
  }

 private:
  bool open_next() {
    if (next_ == parts_.size() || bytes_each_ == 0) return false;
    const VoxelPart& part = parts_[next_++];
    current_.emplace(part.file, coding_, part.offset);
    left_ = bytes_each_;
    return true;
  }

  std::vector<VoxelPart> parts_;
  ByteStream::Coding coding_;
  std::uint64_t bytes_each_, left_ = 0;
  std::size_t next_ = 0;
  std::optional<ByteStream> current_;
};

class NthValueSource : public ByteSource {
 public:
  NthValueSource(ByteStream tuples, std::size_t value_bytes, std::size_t values, std::size_t which)
      : tuples_(std::move(tuples)),
        width_(value_bytes),
        stride_(value_bytes * values),
        first_(value_bytes * which),
        block_(std::max<std::size_t>(1, kBlockBytes / stride_) * stride_) {}

  std::size_t read(std::span<std::byte> out) override {
    std::size_t done = 0;
    while (done < out.size() && (at_ < ready_.size() || refill())) {
      const std::size_t piece = std::min(out.size() - done, ready_.size() - at_);
      std::memcpy(out.data() + done, ready_.data() + at_, piece);
      done += piece;
      at_ += piece;
    }
    return done;
  }

 private:
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

  bool refill() {
    const std::size_t tuples = tuples_.read(block_) / stride_;
    ready_.resize(tuples * width_);
    at_ = 0;
    for (std::size_t i = 0; i < tuples; ++i) {
      std::memcpy(&ready_[i * width_], &block_[i * stride_ + first_], width_);
    }
    return tuples > 0;
  }

  ByteStream tuples_;
  std::size_t width_, stride_, first_;
  std::vector<std::byte> block_, ready_;
  std::size_t at_ = 0;
};

// One conversion of a whole number and nothing else that printf would act upon.
bool is_plain_pattern(const std::string& name) {
  const std::size_t at = name.find('%');
  if (at == std::string::npos || name.find('%', at + 1) != std::string::npos) return false;
  const std::size_t end = name.find_first_not_of("0123456789", at + 1);
  return end != std::string::npos && end - at <= 3 && (name[end] == 'd' || name[end] == 'i');
}

// The files of a volume that is spread over several, slice by slice or block by block.
// `pattern` = a C format of one number ("slice%03d.raw") and its first, last and step ("1 50 1").
// Throws BadDataError naming `header` when that is no such thing or asks for too many files.
std::vector<fs::path> files_of_pattern(const std::string& pattern, const fs::path& header) {
  // The name may hold spaces; the numbers stand last.
  std::string name = pattern, rest;
  for (int i = 0; i < 3; ++i) {
    const std::size_t space = name.find_last_of(" \t");
    if (space == std::string::npos) break;
    rest = name.substr(space + 1) + " " + rest;
    name = trimmed(name.substr(0, space));
  }
  const auto range = integers(rest, header.string() + ": " + pattern);
  const bool counts = range.size() == 3 && range[2] > 0 && range[0] >= 0 && range[1] >= range[0] &&
                      (range[1] - range[0]) / range[2] < kMostParts;
  if (!is_plain_pattern(name) || !counts)
    throw BadDataError(header, "\"" + pattern.substr(0, 80) +
                                   "\" is no pattern of files; a name with %d, the first and the "
                                   "last number and the step are needed");
  std::vector<fs::path> files;
  for (std::int64_t number = range[0]; number <= range[1]; number += range[2]) {
    std::string file(name.size() + 128, '\0');
    const int length =
        std::snprintf(file.data(), file.size(), name.c_str(), static_cast<int>(number));
    file.resize(static_cast<std::size_t>(length));
    files.push_back(header.parent_path() / file);
  }
  return files;
}

}  // namespace

std::vector<fs::path> listed_files(const std::string& named, const fs::path& header, char mark,
                                   std::initializer_list<std::string_view> fields) {
  if (!named.starts_with("LIST")) return files_of_pattern(named, header);
  std::vector<fs::path> files;
  HeaderText text(header);
  bool behind = false;
  for (std::string line; text.next_line(line);) {
    if (behind && !trimmed(line).empty()) files.push_back(header.parent_path() / trimmed(line));
    const std::string field = lower_case(trimmed(line.substr(0, line.find(mark))));
    behind |= std::find(fields.begin(), fields.end(), field) != fields.end();
  }
  return files;
}

ByteStream joined_parts(std::vector<VoxelPart> parts, ByteStream::Coding coding,
                        std::uint64_t bytes_each) {
  const fs::path first = parts.front().file;
  std::uint64_t most = 0;
  for (const VoxelPart& part : parts)
    most += std::min(bytes_each, ByteStream(part.file, coding, part.offset).most_possible_bytes());
  return ByteStream(first, std::make_unique<PartsSource>(std::move(parts), coding, bytes_each),
                    most);
}

ByteStream every_nth_value(ByteStream tuples, std::size_t value_bytes, std::size_t values,
                           std::size_t which) {
  const fs::path file = tuples.file();
  // One tuple is held in memory; what a header says of its length may be a lie.
  if (values == 0 || values > tuples.most_possible_bytes() / value_bytes)
    throw BadDataError(
        file, "truncated: it cannot hold " + std::to_string(values) + " values for each voxel");
  const std::uint64_t most = tuples.most_possible_bytes() / values;
  return ByteStream(
      file, std::make_unique<NthValueSource>(std::move(tuples), value_bytes, values, which), most);
}

}  // namespace organbake
