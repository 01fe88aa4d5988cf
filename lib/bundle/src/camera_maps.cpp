// SPDX-License-Identifier: Apache-2.0
// A virtual camera's maps as the images that a bundle stores, in channels that other programs
// understand: depth, colour with coverage, and microstructure with its face and confidence.
#include "organbake/bundle/bundle.h"

#include <array>
#include <limits>
#include <string>

#include "organbake/core/text.h"

namespace organbake {

CameraMaps background_maps(int width, int height) {
  CameraMaps maps;
  maps.width = width, maps.height = height;
  const std::size_t count = std::size_t(width) * height;
  maps.depth_mm.assign(count, std::numeric_limits<float>::infinity());
  maps.color.assign(count, Eigen::Vector3f::Zero());
  maps.height_mm.assign(count, 0);
  maps.face.assign(count, kNoFace);
  maps.confidence.assign(count, 0);
  return maps;
}

std::string camera_folder(std::size_t camera) { return "cam_" + padded(camera, 3); }

ChannelImage depth_image(const CameraMaps& maps) {
  // The same plane twice: OpenCV 4.6 reads a file with Z alone as zeros, three.js refuses it.
  return {maps.width, maps.height, {{"Y", maps.depth_mm, false}, {"Z", maps.depth_mm, false}}};
}

ChannelImage color_image(const CameraMaps& maps) {
  std::array<std::vector<float>, 4> rgba;
  for (auto& plane : rgba) plane.resize(maps.color.size());
  for (std::size_t i = 0; i < maps.color.size(); ++i) {
    for (int k = 0; k < 3; ++k) rgba[k][i] = maps.color[i][k];
    rgba[3][i] = maps.face[i] == kNoFace ? 0.0f : 1.0f;
  }
  return {maps.width,
          maps.height,
          {{"R", std::move(rgba[0]), true},
           {"G", std::move(rgba[1]), true},
           {"B", std::move(rgba[2]), true},
           {"A", std::move(rgba[3]), true}}};
}

ChannelImage micro_image(const CameraMaps& maps) {
  return {maps.width,
          maps.height,
          {{"Y", maps.height_mm, false},
           {"face", maps.face, false},
           {"confidence", maps.confidence, true}}};
}

}  // namespace organbake
