// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/player/embedded_player.h"

namespace organbake {

std::vector<EmbeddedPlayer::Point> points_of(const std::vector<Eigen::Vector3d>& vectors);

// What a bundle says of the organ's mechanics and of what hangs on it, in the standard library's
// types alone.
EmbeddedPlayer::Mesh organ_mesh(const Bundle& bundle);

// Forces on a proxy's vertices as forces on the nodes of its tetrahedra, transposed as those carry
// it. Throws UsageError where there are none.
std::vector<Eigen::Vector3d> forces_on_nodes(const Bundle& bundle,
                                             const std::vector<Eigen::Vector3d>& on_vertices);

}  // namespace organbake
