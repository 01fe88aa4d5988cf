// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "image/channel_image.h"

namespace organbake {

// 8-bit RGB; grey and alpha are converted (alpha dropped), 16 bit reduced. Throws NoInputError,
// BadDataError, IoError.
Rgb8Image read_png(const std::filesystem::path& path, std::size_t max_pixels = 1u << 28);
// The bytes of a PNG file, deterministic; compression_level 0…9 (1 is fast enough to play with).
// Throws Error (internal) for an empty image.
std::string encode_png(const Rgb8Image& image, int compression_level = 6);
void write_png(const std::filesystem::path& path, const Rgb8Image& image,
               int compression_level = 6);

}  // namespace organbake
