// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "bundle/cameras_json.h"

namespace organbake {

// cameras.txt and images.txt of a COLMAP text model's folder (camera_files.h).
CameraSet read_colmap_text(const std::filesystem::path& folder);

}  // namespace organbake
