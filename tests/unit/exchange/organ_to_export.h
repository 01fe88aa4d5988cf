// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "support/synthetic_bundle.h"

namespace organbake {

// A lumpy organ of known formula with 8 cameras of 256², made once.
const SyntheticOptions& export_options();
const Bundle& organ_to_export();

// How far a point lies from that organ's surface, along the ray from its centre: at least the
// closest distance.
double off_surface_mm(const Eigen::Vector3d& point);

}  // namespace organbake
