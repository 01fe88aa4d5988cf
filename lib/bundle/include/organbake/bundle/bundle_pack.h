// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"

namespace organbake {

static_assert(std::endian::native == std::endian::little, "packed numbers are little-endian");

// Numbers one after the other, little-endian.
class PackedWriter {
 public:
  template <class Number>
  requires(std::is_arithmetic_v<Number> || std::is_enum_v<Number>) void add(Number number) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&number);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof(Number));
  }
  void add(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  const std::vector<std::byte>& bytes() const { return bytes_; }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

// Reads them back and trusts nothing: every count is held against what is left before memory is
// taken. Throws BadDataError, beginning with `name`.
class PackedReader {
 public:
  PackedReader(std::span<const std::byte> bytes, const std::string& name)
      : rest_(bytes), name_(name) {}

  template <class Number>
  Number next() {
    Number number;
    std::memcpy(&number, take(sizeof(Number)).data(), sizeof(Number));
    return number;
  }
  std::span<const std::byte> take(std::size_t count) {
    if (count > rest_.size())
      fail("ends early: " + std::to_string(count) + " bytes are wanted, " +
           std::to_string(rest_.size()) + " are left");
    const auto taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  void end() const {
    if (!rest_.empty()) fail("has " + std::to_string(rest_.size()) + " bytes too many");
  }
  [[noreturn]] void fail(const std::string& message) const {
    throw BadDataError(name_ + ": " + message);
  }

 private:
  std::span<const std::byte> rest_;
  std::string name_;
};

// A bundle in one piece, as a page carries it: what a player needs of it and nothing else. It
// begins with its contents (contents_of_pack), then come its parts, each a gzip stream of its own,
// whose checksum whoever inflates it verifies: part 0 is the frame, part 1 + c the maps of camera c
// (bundle/stored_maps.h).
struct PackPart {
  std::uint64_t offset = 0;  // of the gzip stream, from the pack's first byte
  std::uint32_t packed_bytes = 0;
  std::uint32_t bytes = 0;  // inflated
};
inline constexpr std::size_t kMostPackParts = 4097;  // the frame and as many cameras as there are

// The pack's first bytes, for parts that follow each other in order; offsets are not looked at.
std::vector<std::byte> pack_contents(const std::vector<PackPart>& parts);
// How long the contents are.
std::size_t pack_contents_bytes(std::size_t parts);
// beginning: the pack's first bytes, at least its contents or all there is. Throws BadDataError for
// what is no pack, is of another version, was changed, or does not add up to total_bytes.
std::vector<PackPart> contents_of_pack(std::span<const std::byte> beginning,
                                       std::uint64_t total_bytes);

// The frame: proxy, cameras, mechanics, skin, base layer and lighting, and the bundle's name.
std::vector<std::byte> packed_frame(const Bundle& bundle);
// The frame of a bundle, inflated. Throws BadDataError as BundleReader::read_frame() does.
Bundle unpacked_frame(std::span<const std::byte> bytes);

}  // namespace organbake
