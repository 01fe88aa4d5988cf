// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct EmbreeScene;

// Depth maps as one traces them with Embree alone: a static scene, one ray a texel in coherent
// packets of 16, tiles spread over TBB, the float depth as it comes.
class EmbreeDepth {
 public:
  explicit EmbreeDepth(const TriangleMesh& mesh);
  ~EmbreeDepth();

  // Planar z by camera, row-major, +inf where there is nothing. Cameras must be free of distortion.
  void trace(const std::vector<PosedCamera>& cameras,
             std::vector<std::vector<float>>& depths_mm) const;

 private:
  std::unique_ptr<EmbreeScene> scene_;
};

}  // namespace organbake
