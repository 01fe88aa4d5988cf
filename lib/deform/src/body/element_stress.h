// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "contact/padded_vector.h"

namespace organbake::deform {

// Four 3×3 matrices side by side: entry (row i, column j) of each in [3 i + j].
struct Matrices {
  Double4 entries[9] = {};
  Double4& operator[](int entry) { return entries[entry]; }
  const Double4& operator[](int entry) const { return entries[entry]; }
};

// The rotations nearest to four matrices (Frobenius): the polar factor, by Newton's iteration with
// Higham's scaling (1986). A matrix that is inside out or flat has its nearest rotation from a
// singular value decomposition instead, the smallest value's sign turned (Irving et al. 2004), so
// that an inverted element is led back the shortest way. Not finite in, anything finite out.
void nearest_rotations(const Matrices& f, Matrices& rotation);

// What four elements store by their deformation F, side by side. In the singular values s of F (the
// least one negative where F is inside out) and with R the rotation nearest to F,
//   W = shear/2 |s − 1|² + 3 bulk/2 |s − s*|²,   shear = 2 μ V, bulk = λ V,
// s* being the nearest values that sum up to 3 and are none below kLeastStretch. Where that bound
// doesn't bite, the second part is bulk/2 (tr RᵀF − 3)²: linear corotational elasticity. That alone
// takes s = (2, 2, −1) for a volume that is kept, and elements turned inside out would stay so.
// Both parts are squared distances, so that W bends by at most shear + 3 bulk, whatever F.
class ElementStress {
 public:
  // Keeps f by reference.
  explicit ElementStress(const Matrices& f);

  // ∂W/∂F.
  void stress(const Double4& shear, const Double4& bulk, Matrices& stress) const;
  // The same of a viscosity of shear strain (mN·mm): R sym(Rᵀ (F − F_start)) viscosity.
  void add_viscous(const Double4& viscosity, const Matrices& f_start, Matrices& stress) const;
  Double4 energy(const Double4& shear, const Double4& bulk) const;

  static constexpr double kLeastStretch = 0.1;

 private:
  void keep_volume();
  void keep_volume_of_lane(int lane);

  const Matrices& f_;
  Matrices rotation_;
  Matrices from_kept_;  // 3 (F − F*)
};

}  // namespace organbake::deform
