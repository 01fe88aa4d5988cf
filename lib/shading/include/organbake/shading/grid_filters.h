// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/grid.h"

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

// Mean over the inside pixels of a square window of 2·radius + 1; where there are none, 0.
[[nodiscard]] Plane box_mean(const Plane& plane, const Mask& inside, int radius);
// Of the inside pixels that are finite.
[[nodiscard]] double median_inside(const Plane& plane, const Mask& inside);

// dv/di at index i of n values `stride` apart: central, of fourth order where there is room and of
// second order elsewhere (one-sided at the ends).
double derivative_at(const float* v, int i, int n, std::ptrdiff_t stride);

// The same for a whole row at once, per pixel: along it (by x), and across it (by y).
void derivatives_along(const Plane& v, int row, std::vector<double>& by_x);
void derivatives_across(const Plane& v, int row, std::vector<double>& by_y);

// Standard deviation of the noise of neighbouring pixels, from the median response of Immerkær's
// mask (1996), which planes and quadrics do not excite. 0 when fewer than nine pixels lie inside.
[[nodiscard]] double noise_level(const Plane& intensity, const Mask& inside);

// Half the size: means over the inside pixels of 2×2, their variance with them; a pixel is inside
// when any of its four is.
[[nodiscard]] ShadedImage halved(const ShadedImage& fine);
// A mean over a pixel of `halvings` levels up made into the value at its centre (the mean is off by
// h²/24 · ∇²I, which a coarse grid would take for shape).
[[nodiscard]] Plane centre_values(const Plane& means, const Mask& inside, int halvings);
// Means over 2×2, and back by bilinear interpolation (extrapolated by half a pixel at the border).
[[nodiscard]] Plane halved(const Plane& fine);
[[nodiscard]] Plane doubled(const Plane& coarse, int width, int height);

// Gives the pixels outside the mask a smooth continuation of those inside (push–pull; Gortler et
// al. 1996). Without any inside pixel all become 0.
void fill_outside(Plane& plane, const Mask& inside);

// What pictures of one piece of tissue have in common, to be matched.

// Grey levels as coded, 0…255 (ITU-R BT.601's weights).
Plane grey_levels(const Rgb8Image& color);

// Brightness against its surroundings (a square of 21 pixels), in standard deviations of them: the
// lamp's fall-off and unlike gains are gone, and what is no stronger than a level of noise stays
// weak. 0 where nothing counts.
Plane local_pattern(const Plane& grey, const Mask& counts);

// Means of 2×2 of what counts; a pixel counts when most of it does. An odd last row or column falls
// away.
void halve_counted(Plane& grey, Mask& counts);

// The plane through the values around each pixel, by least squares over a window weighted like a
// tent: what a smooth surface is, near by. All pixels at once; large windows look at squares of
// pixels.
class LocalPlanes {
 public:
  // weight: how much a pixel's value counts, 0 = not at all.
  LocalPlanes(const Plane& value, const Plane& weight, int radius_px);
  ~LocalPlanes();

  // The weight around a pixel, as a mean over the window.
  float weight(int x, int y) const;
  struct Fit {
    float value = 0;     // of the plane at the pixel
    float variance = 0;  // of the values about the plane
  };
  // Only where the weight is positive.
  Fit at(int x, int y) const;

 private:
  struct Moments;
  std::unique_ptr<const Moments> moments_;
};

}  // namespace organbake
