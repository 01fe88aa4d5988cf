// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/bundle/mechanics_model.h"

namespace organbake {

// The order in which the factor of the springs' matrix should eliminate the vertices that are no
// anchors (MechanicsModel::elimination_order), by nested dissection (METIS; Karypis & Kumar 1998).
// Empty for nets of less than some thousand vertices: minimum degree, which the player has itself,
// leaves about as sparse a factor there (CHOLMOD compares them: Chen et al. 2008).
std::vector<std::uint32_t> elimination_order(const MechanicsModel& model);

}  // namespace organbake
