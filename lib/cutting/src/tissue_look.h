// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace organbake {

// The albedo (linear RGB) of tissue on the inside, at a place at rest, so far below the skin: a
// thin capsule, a rim wet with blood, then that of the skin, darker and redder, mottled and with
// fibres, the same wherever a cut comes by.
Eigen::Vector3f inner_albedo(const Eigen::Vector3d& at_mm, double depth_mm,
                             const Eigen::Vector3f& skin_albedo);

}  // namespace organbake
