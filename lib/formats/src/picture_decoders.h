// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "organbake/image/channel_image.h"
#include "organbake/image/picture.h"

namespace organbake {

// An EXR image as a picture: R, G, B or a grey Y, in linear light as the format has it; where there
// is alpha, colours are freed from it. Its 8-bit copy is exposed so that the brightest of its
// thousand parts does not clip, unless it already lies well in 0…1. Throws BadDataError.
StoredPicture parse_exr_picture(std::span<const std::byte> bytes, const std::string& name);

// 8-bit RGB from a baseline or progressive JPEG (grey is spread over the channels). An Exif
// orientation is not applied: intrinsics belong to the pixels as the sensor gave them. Throws
// NoInputError, or BadDataError for anything damaged, truncated, CMYK or larger than max_pixels.
Rgb8Image read_jpeg(const std::filesystem::path& path, std::size_t max_pixels = 1u << 28);
Rgb8Image parse_jpeg(std::span<const std::byte> bytes, const std::string& name,
                     std::size_t max_pixels = 1u << 28);

// What a picture file says about its pixels besides their values.
struct PictureTags {
  Turn turn = Turn::none;
  double pixel_aspect = 1;  // a pixel's width / its height
};

// Exif's orientation (Exif 2.32, tag 0x0112) and the pixels' aspect of a JPEG (JFIF's densities) or
// a PNG (pHYs). Tags that are absent, damaged or senseless are not there; never throws.
PictureTags jpeg_tags(std::span<const std::byte> file);
PictureTags png_tags(std::span<const std::byte> file);

}  // namespace organbake
