// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/registration/register_photo.h"

namespace organbake {

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
