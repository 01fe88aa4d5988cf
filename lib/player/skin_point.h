// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "bundle/bundle.h"

namespace organbake {

// The place where a line from the organ's centre along a direction leaves the skin at rest (the
// base layer's lattice over the proxy). Throws BadDataError when it meets none.
Eigen::Vector3d skin_point(const Bundle& bundle, const Eigen::Vector3d& direction);

}  // namespace organbake
