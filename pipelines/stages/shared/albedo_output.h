// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/pipelines/stage.h"
#include "organbake/shading/frame_depth.h"

namespace organbake {

// As the stages' descriptions have it.
inline constexpr const char* kScopePhotoFile = "photo/camera.json";

// The frame's tissue with the scope's light divided out: albedo.png, lighting.json with the light
// that belongs to it, and how much is left in, into the report. Returns the albedo, sRGB.
Rgb8Image write_albedo(const std::filesystem::path& folder, const PreparedFrame& frame,
                       const FrameDepth& depth, const LaparoscopeOptions& lamp, double mm_per_unit,
                       StageReport& report);

// The picture that a surface in camera axes was read from, in its own pixels, with its camera:
// photo/camera.json, which the stages `place` and `capture` take.
void write_scope_photo(const std::filesystem::path& folder, const Rgb8Image& picture,
                       const Intrinsics& camera);

}  // namespace organbake
