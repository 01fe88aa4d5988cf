// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace organbake {

// The studio's lights, fixed in the world (LPS) so that every photograph shows the same shading:
// a warm key from the front, right and above, a cool fill from behind on the left, and an ambient
// that is brighter from above. Directional, without shadows. Linear.
//   L = albedo ∘ (ambient(n) + key max(0, n·k) + fill max(0, n·f)) + specular
//   specular = Σ light (0.045 max(0, n·h)^25 + 0.32 max(0, n·h)^180),  h = the half vector
// (Blinn 1977), twice: the sheen of moist tissue and the glints of the film on it.
Eigen::Vector3d lit_diffuse(const Eigen::Vector3d& albedo, const Eigen::Vector3d& normal);
Eigen::Vector3d lit_specular(const Eigen::Vector3d& normal, const Eigen::Vector3d& toward_eye);

}  // namespace organbake
