// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/joined_bytes.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <optional>
#include <utility>

#include "files/header_text.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

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
  if (!is_plain_pattern(name) || !counts) {
    throw BadDataError(header, "\"" + pattern.substr(0, 80) +
                                   "\" is no pattern of files; a name with %d, the first and the "
                                   "last number and the step are needed");
  }
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

ByteStream joined_parts(std::vector<VoxelPart> parts, ByteStream::Coding coding,
                        std::uint64_t bytes_each) {
  const fs::path first = parts.front().file;
  std::uint64_t most = 0;
  for (const VoxelPart& part : parts) {
    most += std::min(bytes_each, ByteStream(part.file, coding, part.offset).most_possible_bytes());
  }
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
