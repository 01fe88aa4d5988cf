// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/byte_stream.h"

#include <bzlib.h>
#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "organbake/core/error.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

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
    if (descriptor_ < 0) {
      throw NoInputError(file, std::string("cannot be opened: ") + std::strerror(errno));
    }
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

 protected:
  [[noreturn]] void damaged() const {
    throw BadDataError(file_, "its compressed data is damaged or truncated");
  }
  std::size_t refill() { return input_.read(chunk_); }
  char* chunk() { return reinterpret_cast<char*>(chunk_.data()); }

 private:
  fs::path file_;
  FileSource input_;
  std::vector<std::byte> chunk_;
};

class InflateSource : public Decompressor {
 public:
  InflateSource(const fs::path& file, std::uint64_t offset) : Decompressor(file, offset) {
    constexpr int kGzipOrZlib = 32 + MAX_WBITS;
    if (inflateInit2(&z_, kGzipOrZlib) != Z_OK) throw std::bad_alloc();
  }
  ~InflateSource() override { inflateEnd(&z_); }

  std::size_t read(std::span<std::byte> out) override {
    std::size_t done = 0;
    while (done < out.size() && !ended_) {
      if (z_.avail_in == 0 && !feed()) damaged();
      const std::size_t room = std::min(out.size() - done, std::size_t{1} << 30);
      z_.next_out = reinterpret_cast<Bytef*>(out.data() + done);
      z_.avail_out = static_cast<uInt>(room);
      const int result = inflate(&z_, Z_NO_FLUSH);
      done += room - z_.avail_out;
      if (result == Z_STREAM_END) {
        next_member();
      } else if (result != Z_OK) {
        damaged();
      }
    }
    return done;
  }

 private:
  bool feed() {
    z_.next_in = reinterpret_cast<Bytef*>(chunk());
    z_.avail_in = static_cast<uInt>(refill());
    return z_.avail_in > 0;
  }
  // gzip files may be several members one after the other (pigz, bgzip). What follows the last
  // member and is not another one is padding.
  void next_member() {
    constexpr Bytef kGzipMagic = 0x1f;
    if ((z_.avail_in == 0 && !feed()) || *z_.next_in != kGzipMagic) {
      ended_ = true;
    } else {
      inflateReset(&z_);
    }
  }

  z_stream z_{};
  bool ended_ = false;
};

class Bunzip2Source : public Decompressor {
 public:
  Bunzip2Source(const fs::path& file, std::uint64_t offset) : Decompressor(file, offset) {
    if (BZ2_bzDecompressInit(&bz_, 0, 0) != BZ_OK) throw std::bad_alloc();
  }
  ~Bunzip2Source() override { BZ2_bzDecompressEnd(&bz_); }

  std::size_t read(std::span<std::byte> out) override {
    std::size_t done = 0;
    while (done < out.size() && !ended_) {
      if (bz_.avail_in == 0) {
        bz_.next_in = chunk();
        bz_.avail_in = static_cast<unsigned>(refill());
        if (bz_.avail_in == 0) damaged();
      }
      const std::size_t room = std::min(out.size() - done, std::size_t{1} << 30);
      bz_.next_out = reinterpret_cast<char*>(out.data() + done);
      bz_.avail_out = static_cast<unsigned>(room);
      const int result = BZ2_bzDecompress(&bz_);
      done += room - bz_.avail_out;
      ended_ = result == BZ_STREAM_END;
      if (!ended_ && result != BZ_OK) damaged();
    }
    return done;
  }

 private:
  bz_stream bz_{};
  bool ended_ = false;
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
  switch (coding) {
    case Coding::raw:
      source_ = std::make_unique<FileSource>(file, offset);
      most_possible_bytes_ = left;
      break;
    case Coding::deflate:
      source_ = std::make_unique<InflateSource>(file, offset);
      most_possible_bytes_ = left * kDeflateRatio;
      break;
    case Coding::bzip2:
      source_ = std::make_unique<Bunzip2Source>(file, offset);
      most_possible_bytes_ = left * kBzip2Ratio;
      break;
  }
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

}  // namespace organbake
