// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace organbake {

// A zlib stream (RFC 1950) of the bytes, by runs of one byte and Huffman codes alone: of what a
// predictor left of a picture it is up to a fifth larger than libdeflate's level 1, in an eighth of
// the time. Returns its size; `to` must have room for the bound.
std::size_t run_deflate(std::span<const std::uint8_t> bytes, char* to);
std::size_t run_deflate_bound(std::size_t bytes);

}  // namespace organbake
