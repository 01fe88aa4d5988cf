// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "deform/rows.h"

namespace organbake {

// Weights of b and c (a has the rest) at the point of triangle abc nearest to p; a triangle that is
// an edge or a point gives the nearest of what it is (Ericson, Real-Time Collision
// Detection, 5.1.5).
struct TriangleWeights {
  double b = 0, c = 0;
};
TriangleWeights nearest_on_triangle(const Lanes& p, const Lanes& a, const Lanes& b, const Lanes& c);

}  // namespace organbake
