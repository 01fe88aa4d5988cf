// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

namespace organbake {

// Where a ByteStream's bytes come from; one class for each coding.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  // Fills `out` as far as it can; fewer bytes only at the end.
  virtual std::size_t read(std::span<std::byte> out) = 0;
  // Passes over bytes; fewer only at the end. How many.
  virtual std::uint64_t skip(std::uint64_t count);
  // Fills `out` from so many bytes ahead, by any number of threads at once, and stays where it is.
  // Only where reads_ahead().
  virtual std::size_t read_ahead(std::uint64_t, std::span<std::byte>) const { return 0; }
  virtual bool reads_ahead() const { return false; }
};

// The bytes of a file from an offset on, decompressed on the way in small pieces, so that voxels
// can be read to where they stay and a lying header costs no memory. Throws NoInputError when the
// file cannot be opened, BadDataError when it is damaged, IoError when the system fails.
class ByteStream {
 public:
  enum class Coding { raw, deflate /* gzip or zlib, told by its first bytes */, bzip2 };

  explicit ByteStream(const std::filesystem::path& file, Coding coding = Coding::raw,
                      std::uint64_t offset = 0);

  // From a source of another kind; `file` is for errors.
  ByteStream(std::filesystem::path file, std::unique_ptr<ByteSource> source,
             std::uint64_t most_possible_bytes);

  const std::filesystem::path& file() const { return file_; }
  std::size_t read(std::span<std::byte> out) { return source_->read(out); }
  // Throws BadDataError ("truncated") when fewer bytes are left.
  void read_exactly(std::span<std::byte> out);
  void skip(std::uint64_t count);  // without reading, where bytes are not packed
  // Whether read_ahead() can read from anywhere, by several threads at once: of a file that is not
  // packed. Throws as read_exactly() does, and leaves the stream where it is.
  bool reads_ahead() const { return source_->reads_ahead(); }
  void read_ahead(std::uint64_t bytes, std::span<std::byte> out) const;
  // No stream of this size and coding can hold more.
  std::uint64_t most_possible_bytes() const { return most_possible_bytes_; }

 private:
  [[noreturn]] void fail_truncated() const;

  std::filesystem::path file_;
  std::unique_ptr<ByteSource> source_;
  std::uint64_t most_possible_bytes_ = 0;
};

}  // namespace organbake
