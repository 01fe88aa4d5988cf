// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "measuring/depth_agreement.h"
#include "organbake/image/picture.h"
#include "organbake/shading/frame_depth.h"

namespace organbake {

// A picture of tissue, and the depth of some of its pixels.
struct ReliefScene {
  std::string name;
  StoredPicture picture;
  Intrinsics camera;
  FrameOptions frame;
  ShadingOptions shading;
  std::vector<SeenPoint> truth;  // pixels of the picture
};

// One scene a seed: several tissues under a lamp whose beam shading is mostly not told, with noise,
// texture and a JPEG's loss. Even seeds show the bed of LaparoscopyPhantom, odd ones MovingClip's
// liver, gallbladder and fat.
ReliefScene seeded_relief_scene(std::uint64_t seed);

// `count` frames of a clip, evenly spread over those that a COLMAP model of it has, with its
// points.
std::vector<ReliefScene> clip_relief_scenes(const std::filesystem::path& video,
                                            const std::filesystem::path& model, std::size_t count);

}  // namespace organbake
