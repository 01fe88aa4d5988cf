// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "image/channel_image.h"

namespace organbake {

// 8-bit RGB; grey and alpha are converted (alpha dropped), 16 bit reduced. Throws NoInputError,
// BadDataError, IoError.
Rgb8Image read_png(const std::filesystem::path& path, std::size_t max_pixels = 1u << 28);
// Deterministic bytes; compression_level 0…9 (1 is fast enough to play with).
void write_png(const std::filesystem::path& path, const Rgb8Image& image,
               int compression_level = 6);

}  // namespace organbake
