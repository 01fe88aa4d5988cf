// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace organbake {

// Looks at an EXR file's header before OpenEXR does, which takes memory for whatever it says:
// a single part of scan lines, none of them subsampled, in a compression of the allow-list (NONE,
// ZIP, ZIPS, PIZ, PXR24, DWAA, DWAB), every attribute of the size of its type, of at most
// max_pixels, and of no more than such a file can unpack to. Throws std::runtime_error that says
// what is wrong.
void check_exr_header(std::span<const std::byte> file, std::size_t max_pixels);

}  // namespace organbake
