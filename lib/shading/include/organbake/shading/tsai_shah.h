// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/shading/distant.h"
#include "organbake/shading/grid.h"

namespace organbake {

struct TsaiShahOptions {
  DistantLight light;
  int iterations = 5;

  void check() const;  // throws UsageError: iterations in 1…1000000, finite light
};

struct TsaiShahEstimate {
  Grid<double> depth;   // Z, pixels, away from the camera
  double residual = 0;  // root mean square of I − R after the last iteration
};

// The paper's method (2.1.1; Tsai & Shah 1994): f = I − max(0, R), p and q backward differences of
// the last iteration's Z (Jacobi), both zero in the first column and row, and per pixel
//   Zⁿ = Zⁿ⁻¹ − K f,   K = df / (W + Σ_{m≤n} df_m²),   W = 1e-8.
// As printed the step is −f/df, which is 0/0 at Z = 0 under frontal light and for tilts of 135° and
// −45° and diverges elsewhere; the sum bounds it. Where df is 0 the depth stays what it is.
// `intensity` in 0…1; not finite counts as black. `start` = Z of the previous frame (Z_t⁰ =
// Z_{t−1}). Its depth is about as wrong as a flat plane under oblique light; it is here as the
// baseline.
TsaiShahEstimate shade_tsai_shah(const Plane& intensity, const TsaiShahOptions& options,
                                 const Grid<double>* start = nullptr);

}  // namespace organbake
