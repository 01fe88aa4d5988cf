// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "body/element_stress.h"
#include "body/tissue.h"
#include "organbake/deform/deformer.h"

namespace organbake::deform {

// Linear corotational finite elements (Müller & Gross 2004; its energy as Chao et al. 2010 have it)
// in the springs' place, with the tissue's modulus and density and the body's Poisson's ratio: W is
// that of element_stress.h, for small displacements linear elasticity. Steps lead along
// A = M/dt² + Σ V (2μ (1 + damping/dt) + 3/2 λ) ∇φᵢ·∇φⱼ, at least half of what W bends by however
// elements are turned: each lowers the energy, and what they converge to is the backward Euler step
// itself. The points are the nodes; they carry the proxy's vertices.
class FemBody final : public Tissue {
 public:
  // Throws UsageError when one's mechanics hold no tetrahedra, and BadDataError for ones that don't
  // fit the proxy or have a value out of range.
  FemBody(const DeformBodies& bodies, double time_step_s);

  void local_step(const PaddedVectors& x, const PaddedVectors& x_start,
                  const PaddedVectors& x_coasted, PaddedVectors& force) const override;
  double energy(const PaddedVectors& x, const PaddedVectors& x_start) const override;

 private:
  // Four elements side by side.
  struct Block {
    std::array<std::array<std::uint32_t, 4>, 4> slots{};  // [element][corner]
    Matrices gradients{};                                 // row k: ∇φ of corner k + 1, 1/mm
    Double4 shear{}, bulk{};                              // 2 μ V and λ V, mN·mm
    Double4 viscous{};                                    // 2 μ V damping/dt, mN·mm
  };
  struct Solid;
  void place_slots(const Solid& solid, const std::vector<std::uint32_t>& free_of_node);
  void place_elements(const Solid& solid);
  void find_pieces(const Solid& solid, const DeformBodies& bodies);
  static Matrices deformation_of(const Block& block, const Double4* at);
  static void push(const Block& block, const Matrices& stress, Double4* force);

  bool damped_ = false;
  std::vector<Block> blocks_;  // filled up with elements that do nothing
};

}  // namespace organbake::deform
