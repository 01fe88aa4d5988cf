// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/fusion/depth_view.h"
#include "organbake/motion/key_depths.h"
#include "stages/motion/motion_clip.h"

namespace organbake {

// Brings all lengths to `factor` times what they are, and makes the camera of one frame the world:
// whoever looks from there sees the tissue as that frame shows it.
void scale_and_place(double factor, const RigidTransform& camera_from_world, ClipMotion& motion,
                     std::vector<KeyDepth>& keys);

// cameras.json of all posed frames, colmap/ with the points and where they are seen, points.ply.
void write_scene(const std::filesystem::path& folder, const FollowedClip& clip,
                 const ClipMotion& motion, const ClipPictures& pictures);

// motion.png: the points over the middle key frame, near ones warm, and the scope's way.
void write_overlay(const std::filesystem::path& folder, const ClipMotion& motion,
                   const ClipPictures& pictures, std::size_t frame);

// The key frames as they are fused.
std::vector<DepthView> depth_views(const FollowedClip& clip, const std::vector<KeyDepth>& keys);

}  // namespace organbake
