// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "viewpoints/sample_bits.h"

namespace organbake {

// What a set of cameras must do: at least `samples` samples seen by at least `overlap` of them.
struct CoverGoal {
  std::size_t samples = 0;
  int overlap = 2;
};

// The linear relaxation of choosing the fewest candidates that reach a goal: min Σx with
// Σ_i z_i ≥ goal.samples, Σ_j seen_ij x_j ≥ overlap · z_i, 0 ≤ z ≤ 1, 0 ≤ x ≤ 1.
struct CoverRelaxation {
  // No choice of fewer candidates reaches the goal. Proved by the prices (weak duality), so true
  // however early the search for good ones ended; ceil() of it bounds a count.
  double lower_bound = 0;
  std::vector<double>
      prices;  // one a sample, ≥ 0: what covering it costs (dual); 0 = comes by itself
  std::vector<double> shares;          // one a candidate, 0…1: how much of it the relaxation uses
  std::vector<std::uint32_t> rounded;  // a choice of candidates made of it, if any
};

// For samples that all matter alike, as on smooth surfaces. By the primal-dual hybrid gradient with
// diagonal steps and restarts at the mean (Pock & Chambolle 2011; Applegate et al. 2021), until the
// bound cannot become another whole number or its steps have cost what `most_steps` over the whole
// matrix seen_ij would. Samples outside `among` are left out. Deterministic.
CoverRelaxation relax_cover(const std::vector<SampleBits>& seen, const SampleBits& among,
                            const CoverGoal& goal, double most_steps);

}  // namespace organbake
