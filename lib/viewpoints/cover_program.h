// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/run_context.h"
#include "viewpoints/cover_relaxation.h"

namespace organbake {

// The same for samples of which few decide, as in folds, and tighter: a candidate can stand for one
// of the `overlap` that see a sample only, also where the sample is given up in part:
//   Σ_j∈J seen_ij x_j ≥ (overlap − k) z_i for all candidates J but any k < overlap.
// Rounded by taking what the relaxation uses most, one after the other, and solving again.
//
// By GLPK's dual simplex method, inequalities added as they are violated. After `most_pivots` it
// ends, with the bound that the prices prove by then and nothing rounded. Shares and rounding aim
// at `raised` samples, ≥ goal.samples; the bound is the goal's. Deterministic. Throws
// CancelledError.
CoverRelaxation solve_cover(const std::vector<SampleBits>& seen, const SampleBits& among,
                            const CoverGoal& goal, std::size_t raised, int most_pivots,
                            const RunContext& context = {});

}  // namespace organbake
