// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace organbake {

// Explicit little-endian files in other transfer syntaxes.

// As old archives hold it: implicit little-endian. With `open`, sequences and their items do not
// tell their length but end with a mark.
std::string as_implicit(const std::string& file, bool open = false);

// Deflated (PS3.5, A.5).
std::string as_deflated(const std::string& file);

// Pixels of 16 bits, `side` by `side`, as a codestream by GDCM's encoders; empty where it has none.
std::string codestream_in(const std::string& syntax, const std::vector<std::uint16_t>& pixels,
                          int side);

}  // namespace organbake
