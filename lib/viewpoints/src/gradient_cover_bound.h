// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "choose_cover.h"
#include "organbake/viewpoints/sample_bits.h"

namespace organbake {

// No choice of fewer candidates than ceil(bound) reaches a goal. This and simplex_cover_bound() are
// proved by prices of the samples (weak duality), so they are true however early the search for
// good prices ended. Deterministic.

// By the linear relaxation min Σx with Σ_i z_i ≥ goal.samples, Σ_j seen_ij x_j ≥ overlap · z_i,
// 0 ≤ z ≤ 1, 0 ≤ x ≤ 1, for samples that all matter alike, as on smooth surfaces. By the
// primal-dual hybrid gradient with diagonal steps and restarts at the mean (Pock & Chambolle 2011;
// Applegate et al. 2021), until the bound cannot become another whole number or its steps have cost
// what `most_steps` over the whole matrix seen_ij would.
double gradient_cover_bound(const std::vector<SampleBits>& seen, const CoverGoal& goal,
                            double most_steps);

// The best bound that prices prove, over any scale s of them: s · worth − Σ max(0, s · paid − 1)
// over candidates. paid: what each candidate's samples pay for it.
double best_scaled_bound(double worth, std::vector<double> paid);

}  // namespace organbake
