// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/shading/grid.h"
#include "organbake/shading/ray_grid.h"

namespace organbake {

// What a fit is told about an image, all of one size.
struct ShadedImage {
  Plane intensity;  // linear, any scale, ≥ 0
  Plane variance;   // of the intensity's noise; > 0
  Mask inside;      // pixels whose intensity counts
  RayGrid rays;
};

struct RangeFitOptions {
  int outer_steps = 2;   // linearisations
  int inner_steps = 15;  // conjugate gradients in each
  // Share of the model that it can never explain: differences, texture. Bounds what a pixel counts.
  double model_error = 0.004;
  // Root of the surface's curvature power, (1/normalised coordinate)² · length: how rough ln r may
  // be where the image is silent. Larger follows noise, smaller flattens ridges.
  double roughness = 0.25;
};

// What is known of ln r from elsewhere, by pixel.
struct HeldRange {
  Plane log_range;
  Plane weight;  // 1 / variance; 0 = nothing is known
};

struct FitSummary {
  int inner_steps = 0;  // of all outer steps
  double misfit = 0;    // root mean square of (image / model − 1), a pixel by 1 / variance
};

// Refines v = ln r (Plane of rays.width × rays.height, no gaps) by penalised least squares
//   Σ (I − M(v))²/σ²  +  μ Σ (v_xx² + 2 v_xy² + v_yy²),   ln M = −2v − ½ ln(1+G)
// with second-order differences. The upwind solution that it starts from has the right branch and
// O(h) errors; at borders where the surface comes nearer it knows nothing from outside, and noise
// pulls it to the camera: all three are mended here. μ follows from σ and the roughness, so the
// smoothing width is the data's own and does not change with resolution. Pixels outside are bridged
// by the penalty. With `held` the sum has w (v − held)², too.
FitSummary fit_log_range(const ShadedImage& image, const RangeFitOptions& options, Plane& v,
                         const HeldRange* held = nullptr);

// How rough ln r may be where the image is silent (RangeFitOptions::roughness), from the surface
// itself: in proportion to its root mean square curvature on a coarse level, where noise hardly
// reaches it. Within bounds, so that neither a plane nor a level that went astray decides.
double roughness_of(const Plane& log_range, const ShadedImage& image);

}  // namespace organbake
