// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/image/channel_image.h"
#include "organbake/image/picture.h"

namespace organbake {

// A photograph as 8-bit sRGB: PNG or JPEG, told by its first bytes and not by its name. Throws
// NoInputError or BadDataError.
Rgb8Image read_photo(const std::filesystem::path& path);

// The same, and EXR, with all that the file has: light of more than 8 bits, its turn, the pixels'
// aspect. Nothing is applied (make_upright() does).
StoredPicture read_picture(const std::filesystem::path& path);

}  // namespace organbake
