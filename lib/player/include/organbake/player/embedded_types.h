// SPDX-License-Identifier: Apache-2.0
#pragma once

// Between the types of embedded_player.h, which show the standard library alone, and ours.

#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/instruments/instrument.h"
#include "organbake/player/embedded_player.h"

namespace organbake {

// The instruments that an embedding program's, or Python's, tips stand for. Throws UsageError
// naming the tip that does more than one thing.
std::vector<Instrument> instruments_from(const std::vector<EmbeddedPlayer::Tip>& tips);

std::vector<EmbeddedPlayer::Point> points_of(const std::vector<Eigen::Vector3d>& vectors);

// What a bundle says of the organ's mechanics and of what hangs on it, in the standard library's
// types alone.
EmbeddedPlayer::Mesh organ_mesh(const Bundle& bundle);

// Forces on a proxy's vertices as forces on the nodes of its tetrahedra, transposed as those carry
// it. Throws UsageError where there are none.
std::vector<Eigen::Vector3d> forces_on_nodes(const Bundle& bundle,
                                             const std::vector<Eigen::Vector3d>& on_vertices);

}  // namespace organbake
