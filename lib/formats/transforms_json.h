// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "bundle/cameras_json.h"

namespace organbake {

// A NeRF's transforms.json (camera_files.h): lens keys at the top or per frame.
CameraSet read_transforms_json(const std::filesystem::path& path);

}  // namespace organbake
