// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/registration/register_photo.h"
#include "stages/shared/posed_depth.h"

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

// A photograph by its file name, and what registration made of it.
struct NamedPose {
  std::string image;
  RegisteredPhoto registered;
};

// cameras.json with a verdict at every camera. Cameras whose verdict is not ok stand under
// left_out, with their reason, so that nothing that reads cameras takes them for posed.
std::string pose_document(const std::vector<NamedPose>& poses);

// The cameras that are ok, or all of them.
CameraSet posed_cameras(const std::vector<NamedPose>& poses, bool all);

}  // namespace organbake
