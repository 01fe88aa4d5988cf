// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "support/organs.h"
#include "support/testing.h"

namespace organbake {

// A lumpy organ of known formula with 8 cameras of 256², made once.
inline const SyntheticOptions& export_options() {
  static const SyntheticOptions options = [] {
    SyntheticOptions o;
    o.organ.lump_share = 0.05;
    o.camera_count = 8;
    o.map_size = 256;
    o.base_step_mm = 1.5;
    return o;
  }();
  return options;
}

inline const Bundle& organ_to_export() {
  static const Bundle bundle = make_synthetic_bundle(export_options());
  return bundle;
}

// How far a point lies from that organ's surface, along the ray from its centre: at least the
// closest distance.
inline double off_surface_mm(const Eigen::Vector3d& point) {
  const Eigen::Vector3d from_center = point - export_options().organ.center;
  return std::abs(from_center.norm() - export_options().organ.radius(from_center.normalized()));
}

}  // namespace organbake
