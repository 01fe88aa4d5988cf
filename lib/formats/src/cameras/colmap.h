// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/run_context.h"

namespace organbake {

// cameras.txt and images.txt of a COLMAP model's folder, or cameras.bin and images.bin
// (camera_files.h).
CameraSet read_colmap_text(const std::filesystem::path& folder, const RunContext& context);
CameraSet read_colmap_binary(const std::filesystem::path& folder, const RunContext& context);

}  // namespace organbake
