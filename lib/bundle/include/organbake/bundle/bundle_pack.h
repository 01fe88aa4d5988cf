// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "organbake/bundle/bundle_files.h"

namespace organbake {

// A bundle in one piece, as a page carries it: what a player needs of it and nothing else. It
// begins with its contents (contents_of_pack), then come its parts, each a gzip stream of its own,
// whose checksum whoever inflates it verifies: part 0 is the frame, part 1 + c the maps of camera c
// (bundle/map_code.h).
struct PackPart {
  std::uint64_t offset = 0;  // of the gzip stream, from the pack's first byte
  std::uint32_t packed_bytes = 0;
  std::uint32_t bytes = 0;  // inflated
};
inline constexpr std::size_t kMostPackParts = 4097;  // the frame and as many cameras as there are

// The pack's first bytes, for parts that follow each other in order; offsets are not looked at.
std::vector<std::byte> pack_contents(const std::vector<PackPart>& parts);
// How long the contents are; never more than kMostContents.
std::size_t pack_contents_bytes(std::size_t parts);
inline constexpr std::size_t kMostContents = 64 * 1024;
// beginning: the pack's first bytes, at least its contents or all there is. Throws BadDataError for
// what is no pack, is of another version, was changed, or does not add up to total_bytes.
std::vector<PackPart> contents_of_pack(std::span<const std::byte> beginning,
                                       std::uint64_t total_bytes);

// The frame: proxy, cameras, mechanics, skin, base layer and lighting, and the bundle's name.
std::vector<std::byte> packed_frame(const Bundle& bundle);
// The frame of a bundle, inflated. Throws BadDataError as BundleReader::read_frame() does.
Bundle unpacked_frame(std::span<const std::byte> bytes);

}  // namespace organbake
