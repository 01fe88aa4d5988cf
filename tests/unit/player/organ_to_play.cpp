// SPDX-License-Identifier: Apache-2.0
#include "organ_to_play.h"

namespace organbake {

const SyntheticOptions& organ_options() {
  static const SyntheticOptions options = [] {
    SyntheticOptions o;
    o.organ.lump_share = 0.05;
    return o;
  }();
  return options;
}

const Bundle& organ_to_play() {
  static const Bundle bundle = make_synthetic_bundle(organ_options());
  return bundle;
}

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
