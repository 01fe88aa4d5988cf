// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace organbake {

// Bytes as base64 (RFC 4648), on one line, filled up to whole groups of four letters.
std::string to_base64(std::span<const std::byte> bytes);

// Takes four letters of base64 (RFC 4648; white space is passed over) off the text and adds the one
// to three bytes that they stand for. False, with nothing added, where there are no four.
[[nodiscard]] bool take_base64_group(std::string_view& text, std::string& bytes);

}  // namespace organbake
