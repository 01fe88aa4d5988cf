// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/warp/view.h"
#include "peers/skinned_mesh.h"

namespace organbake {

// Mesa's llvmpipe through EGL without a display: the textured mesh drawn as a game engine draws it,
// its vertices uploaded anew each frame. It draws on the thread that calls.
class SoftwareGl {
 public:
  // Throws Error when no software renderer can be had; says why.
  // samples: of the outlines, a pixel; 1 or 4.
  SoftwareGl(const SkinnedMesh& skinned, int width, int height, int samples = 1);
  ~SoftwareGl();

  // positions: one per vertex, mm. Returns when the picture is done.
  void draw(const std::vector<Eigen::Vector3d>& positions, const View& view);
  std::string renderer() const;  // as the driver names itself
  // The last one, on black.
  Rgb8Image picture() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
