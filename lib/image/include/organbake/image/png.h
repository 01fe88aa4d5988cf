// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "organbake/image/channel_image.h"
#include "organbake/image/picture.h"

namespace organbake {

// 8-bit RGB; grey and palettes are converted, 16 bit reduced, alpha dropped: a pixel keeps its
// colour, and is black where it is wholly transparent. Without a gamma of its own a file is sRGB,
// whatever its depth. Throws NoInputError, BadDataError, IoError.
Rgb8Image read_png(const std::filesystem::path& path, std::size_t max_pixels = 1u << 28);
// The same, with linear light where the file has 16 bits. Tags are left to the caller.
StoredPicture parse_png(std::span<const std::byte> bytes, const std::string& name,
                        std::size_t max_pixels = 1u << 28);
// The bytes of a PNG file, deterministic; compression_level 0…9 (1 is fast enough to play with).
// Throws Error (internal) for an empty image.
std::string encode_png(const Rgb8Image& image, int compression_level = 6);
// With alpha, one value a pixel; colours are not multiplied by it.
std::string encode_png(const Rgb8Image& image, std::span<const std::uint8_t> alpha);
// Numbers rather than light, as masks and depths are stored.
std::string encode_grey_png(int width, int height, std::span<const std::uint8_t> values,
                            int compression_level = 6);
std::string encode_grey_png(int width, int height, std::span<const std::uint16_t> values);
void write_png(const std::filesystem::path& path, const Rgb8Image& image,
               int compression_level = 6);

}  // namespace organbake
