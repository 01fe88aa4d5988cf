// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "organbake/geometry/camera.h"

namespace organbake {

// Throws BadDataError, naming `path`, where a lens cannot be that of pictures of this size: it is
// of another, its focal length is no lens's (shares of the sides, another size), or its axis meets
// the picture far off the middle in both directions, or beside it (a halved or doubled
// calibration). `whose` names the camera among several: "left"; "" = there is one.
void check_lens_of_picture(const Intrinsics& lens, int width, int height,
                           const std::filesystem::path& path, const std::string& whose = "");

}  // namespace organbake
