// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "image/channel_image.h"

namespace organbake {

// A photograph as 8-bit sRGB: PNG or JPEG, told by its first bytes and not by its name. Throws
// NoInputError or BadDataError.
Rgb8Image read_photo(const std::filesystem::path& path);

}  // namespace organbake
