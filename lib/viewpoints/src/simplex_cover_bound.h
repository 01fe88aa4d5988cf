// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "choose_cover.h"
#include "organbake/core/run_context.h"
#include "organbake/viewpoints/sample_bits.h"

namespace organbake {

// No choice of fewer candidates than ceil(bound) reaches a goal, as by gradient_cover_bound().
// For samples of which few decide, as in folds, and tighter: a candidate can stand for one of the
// `overlap` that see a sample only, also where the sample is given up in part:
//   Σ_j∈J seen_ij x_j ≥ (overlap − k) z_i for all candidates J but any k < overlap.
// By GLPK's dual simplex method, inequalities added as they are violated, up to `most_pivots`.
// Throws CancelledError.
double simplex_cover_bound(const std::vector<SampleBits>& seen, const CoverGoal& goal,
                           int most_pivots, const RunContext& context = {});

}  // namespace organbake
