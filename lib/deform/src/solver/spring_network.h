// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "body/tissue.h"
#include "organbake/deform/deformer.h"

namespace organbake::deform {

// Springs, dampers and masses of a proxy as projective dynamics sees them (Bouaziz et al. 2014): an
// implicit Euler step minimises ½|x − y|²_M/dt² + Σ ½k|e − l d|² + Σ ½c/dt (d·Δe)², e = x_a − x_b,
// and with each spring's direction d and the sideways part of Δe held (they are the local step),
// the minimiser solves A u = b, A constant, u = x − rest. Dampers act along their springs, as the
// paper's do: acting on the whole relative velocity they would slow rotation, and a poked organ
// would creep. Every point is a proxy vertex.
class SpringNetwork final : public Tissue {
 public:
  // Throws BadDataError for a model that does not fit its proxy or has a value out of range.
  SpringNetwork(const DeformBodies& bodies, double time_step_s);

  // The forces of inertia, springs and dampers.
  void local_step(const PaddedVectors& x, const PaddedVectors& x_start,
                  const PaddedVectors& x_coasted, PaddedVectors& force) const override;
  double energy(const PaddedVectors& x, const PaddedVectors& x_start) const override;

 private:
  struct Ends {
    std::uint32_t a = 0, b = 0;  // slots, a < b
  };
  struct SpringBlock;
  void measure_block(std::size_t begin, const Double4* at, const Double4* from,
                     SpringBlock& block) const;
  void stand_in(std::size_t spring, const Double4* from, SpringBlock& block, int i) const;
  void pull_block(std::size_t begin, SpringBlock& block) const;
  struct Net;
  std::vector<Coefficient> matrix_of_free(const Net& net, double time_step_s,
                                          const std::vector<std::uint32_t>& free_of_vertex) const;
  void place_slots(const Net& net, double time_step_s,
                   const std::vector<std::uint32_t>& free_of_vertex);
  void place_springs(const Net& net, double time_step_s);
  void find_parts(const Net& net);

  // In order of their slots, filled up to whole blocks with springs that do nothing.
  std::vector<Ends> ends_;
  std::vector<double> length_, stiffness_, damper_;  // l, mm; k, kg/s²; c/dt, kg/s²
};

}  // namespace organbake::deform
