// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/geometry/shell_map.h"
#include "organbake/warp/frame.h"
#include "organbake/warp/solids.h"
#include "organbake/warp/view.h"

namespace organbake {

// An organ as it was last drawn.
struct DrawnOrgan {
  const BaseLayer& base;
  const std::vector<ShellMatrix>& shell;  // world mm, by face
};

// Where everything lay when a picture was drawn: enough to say where any of its points was then.
struct Moment {
  // A shell matrix in the camera's frame, mm; each column in a register of its own.
  using Columns = Eigen::Matrix<float, 4, 9>;

  View view;
  std::vector<std::vector<Columns>> shells;  // by organ and face
  std::vector<Solid> solids;
  std::vector<const BaseLayer*> bases;  // by organ; the player's

  void take(const std::vector<DrawnOrgan>& organs, const View& from,
            const std::vector<Solid>& tools);

  // Of a bound point, camera mm.
  Eigen::Vector3f place(std::size_t organ, const BoundPixel& p) const {
    const Columns& m = shells[organ][p.face];
    return shell_point(m, p.b1, p.b2, p.height_mm).head<3>();
  }

  // Whether the skin round a bound point is turned to the eye, by the small triangle of the base
  // layer that it lies over: near an outline this decides to a fraction of a pixel, where samples,
  // each with the mean slope of its patch, reach a little over it.
  bool faces_eye(std::size_t organ, const BoundPixel& point) const;
};

}  // namespace organbake
