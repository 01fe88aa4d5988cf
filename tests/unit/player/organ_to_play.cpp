// SPDX-License-Identifier: Apache-2.0
#include "organ_to_play.h"

namespace organbake {

Script short_script(double depth_mm) {
  const Eigen::Vector3d front = organ_to_play().cameras.manifold.directions.front();
  Script script;
  script.frames = 8;
  script.camera = {{0, {}}, {7, {0.4, 0.2, 1.1, 0.1}}};
  script.instruments = {{"probe",
                         {.radius_mm = 6},
                         {{0, std::nullopt, front, -5},
                          {0.1, std::nullopt, front, depth_mm},
                          {1, std::nullopt, front, depth_mm}}}};
  return script;
}

}  // namespace organbake
