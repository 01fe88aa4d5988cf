// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "organbake/bundle/lighting.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/warp/view.h"

namespace organbake {

// Finds the range of full exposure for a view, as a camera's automatic exposure would: the skin's
// mean brightness over the picture, its middle counting most, comes to the same each time. By the
// organs' proxies at rest: a poke changes no exposure, and frames depend on nothing before them.
class LightMeter {
 public:
  LightMeter(const ScopeLight& scope, const View& view);

  void add(const TriangleMesh& proxy_at_rest);
  // ScopeLight::reference_mm where that is not 0.
  double reference_mm() const;

 private:
  struct Reading {
    double weight = 0, light = 0;
  };
  Reading read(const TriangleMesh& proxy_at_rest, const Face& face) const;

  ScopeLight scope_;
  RigidTransform camera_from_world_;
  Eigen::Vector2d slopes_at_border_;  // of the picture's sides
  double inverse_tan2_half_;
  double weight_ = 0, light_ = 0;  // sums over faces: of weights, and of weight · light at 1 mm
};

}  // namespace organbake
