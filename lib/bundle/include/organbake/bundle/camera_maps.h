// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

// The maps of one virtual camera, rows top first, all of the camera's size.
// Background: depth +inf, face kNoFace, color and confidence 0.
inline constexpr std::uint32_t kNoFace = 0xFFFFFFFFu;
struct CameraMaps {
  int width = 0, height = 0;
  std::vector<float> depth_mm;         // planar z, +inf where there is nothing
  std::vector<Eigen::Vector3f> color;  // scene-linear
  std::vector<float> height_mm;        // microstructure h over the face's prism
  std::vector<std::uint32_t> face;     // of the shell's surface (the skin or proxy), or kNoFace
  std::vector<float> confidence;       // 0…1: incidence and distance to a depth edge
};

// The folder of a camera's files inside a bundle: "cam_000".
std::string camera_folder(std::size_t camera);
// The maps as the images in that folder: depth.exr, color.exr and micro.exr.
ChannelImage depth_image(const CameraMaps& maps);
ChannelImage color_image(const CameraMaps& maps);
ChannelImage micro_image(const CameraMaps& maps);

}  // namespace organbake
