// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

namespace organbake {

// A rotation that was written down: itself where RᵀR is the identity to rounding, the nearest
// rotation where it is within 1e-4 in every entry (people and programs write four to six digits),
// nothing for what is no rotation or mirrors.
std::optional<Eigen::Matrix3d> written_rotation(const Eigen::Matrix3d& r);

}  // namespace organbake
