// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "bundle/cameras_json.h"

namespace organbake {

// cameras.txt and images.txt of a COLMAP model's folder, or cameras.bin and images.bin
// (camera_files.h).
CameraSet read_colmap_text(const std::filesystem::path& folder);
CameraSet read_colmap_binary(const std::filesystem::path& folder);

// A NeRF's transforms.json (camera_files.h): lens keys at the top or per frame. Throws BadDataError
// naming `path`.
CameraSet transforms_from_json(const nlohmann::ordered_json& json,
                               const std::filesystem::path& path);

}  // namespace organbake
