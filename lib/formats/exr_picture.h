// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "image/picture.h"

namespace organbake {

// An EXR image as a picture: R, G, B or a grey Y, in linear light as the format has it; where there
// is alpha, colours are freed from it. Its 8-bit copy is exposed so that the brightest of its
// thousand parts does not clip, unless it already lies well in 0…1. Throws BadDataError.
StoredPicture parse_exr_picture(std::span<const std::byte> bytes, const std::string& name);

}  // namespace organbake
