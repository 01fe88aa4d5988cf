// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "image/channel_image.h"

namespace organbake {

// 8-bit RGB from a baseline or progressive JPEG (grey is spread over the channels). An Exif
// orientation is not applied: intrinsics belong to the pixels as the sensor gave them. Throws
// NoInputError, or BadDataError for anything damaged, truncated, CMYK or larger than max_pixels.
Rgb8Image read_jpeg(const std::filesystem::path& path, std::size_t max_pixels = 1u << 28);
Rgb8Image parse_jpeg(std::span<const std::byte> bytes, const std::string& name,
                     std::size_t max_pixels = 1u << 28);

}  // namespace organbake
