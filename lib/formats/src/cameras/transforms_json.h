// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "organbake/bundle/cameras_json.h"

namespace organbake {

struct PictureSides {
  int width = 0, height = 0;
};

// A NeRF's transforms.json (camera_files.h): lens keys at the top or per frame. Where these do not
// tell the pictures' size (camera_angle_x alone), it is `picture`, or else that of the first
// frame's own picture. Throws BadDataError naming `path`, for a lens's key that is no number, too.
CameraSet transforms_from_json(const nlohmann::ordered_json& json,
                               const std::filesystem::path& path,
                               std::optional<PictureSides> picture);

}  // namespace organbake
