// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/view_manifold.h"

namespace organbake {

inline constexpr int kLargestPhotoSide_px = 65536;

// cameras.json: posed cameras (photos carry an image file, relative to the document), and the VPM
// when the cameras are virtual ones. Schema: data-schemas/cameras.schema.json.
struct CameraSet {
  std::vector<PosedCamera> cameras;
  std::vector<std::string> images;  // empty, or one file name per camera
  ViewManifold manifold;            // directions empty when the document has no VPM
};

std::string cameras_to_json(const CameraSet& set);
// Throws BadDataError naming `name` and the key: rotations are checked to be proper to 1e-6.
CameraSet cameras_from_json(const std::string& text, const std::string& name);
CameraSet read_cameras(const std::filesystem::path& path);

}  // namespace organbake
