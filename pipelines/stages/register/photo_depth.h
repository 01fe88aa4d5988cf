// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/registration/seen_depth.h"
#include "stages/shared/depth_maps.h"

namespace organbake {

// What a depth map shows, in the axes of the camera that took the photograph.
struct DepthPoints {
  std::vector<Eigen::Vector3d> places;
  std::vector<float> trust;
  bool relative = false;
};
// `lens` is the photograph's, as it was taken. A map that says its own camera is turned as that
// says (a rectified eye), unless the photograph is the rectified one. Throws BadDataError for a map
// that is another lens's, holds no depth, or has lengths that no scope has.
DepthPoints read_depth_points(const DepthFile& file, const Intrinsics& lens,
                              const RunContext& context);

// The depth of a photograph: the map of its name in a folder, the only one there is, or a surface
// that was fused, seen from the camera of the photograph's name in the cameras.json beside it; else
// the surface is taken to be in the camera's own axes. Nothing, which is said, where a folder of
// several has none of the photograph's name.
SeenDepth read_seen_depth(const std::filesystem::path& given, const std::string& photo,
                          const Intrinsics& lens, const RunContext& context);

}  // namespace organbake
