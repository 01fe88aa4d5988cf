// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "organbake/core/run_context.h"
#include "organbake/registration/register_photo.h"

namespace organbake {

// The lens of a file for a photograph, checked against its size; of a fisheye it is said what is
// used. Throws NoInputError, BadDataError.
Intrinsics lens_of_photo(const std::filesystem::path& file, const std::string& name,
                         const Rgb8Image& image, const RunContext& context);

// The photograph as it is registered: a fisheye's straightened to a pinhole, with its mask (what
// the fisheye does not show does not count) and the pixels of its point pairs. Others stay as they
// are.
PhotoToRegister straight_photo(PhotoToRegister photo);

// The registered camera with the lens that took the photograph in the place of the straightened
// one's; a focal length that was sought goes along.
PosedCamera camera_as_taken(const RegisteredPhoto& registered, const Intrinsics& lens);

}  // namespace organbake
