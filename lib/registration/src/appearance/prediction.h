// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "appearance/photo_pyramid.h"
#include "organbake/registration/light_model.h"
#include "organbake/registration/object_pose.h"
#include "organbake/registration/registered_surface.h"

namespace organbake {

// What the photograph should look like, in a window of one pyramid level: rays through the pixels,
// several to a pixel at outlines, so that the picture changes smoothly with the pose. Pixels stay
// where they are and the surface moves behind them: the photograph is never interpolated and its
// noise is in no derivative.
struct Prediction {
  int left = 0, top = 0, width = 0, height = 0;  // of the window in the level; may be empty
  std::vector<float> radiance;                   // Σ weight · φ
  std::vector<float> coverage;                   // share of the pixel that the organ fills, 0…1
  std::vector<Eigen::Vector3f> point;            // camera mm; mean over the hits, zero without
  std::vector<Eigen::Vector3f> normal;           // camera axes, unit; zero without a hit
  std::vector<float> albedo;                     // mean over the hits × coverage
  std::vector<float> phi;                        // `basis` numbers a pixel
  int basis = 0;

  // Of a surface that is open, how many pixels each is from where it is cut, at least about; 0
  // where nothing is hit. Empty for others.
  std::vector<float> border_px;

  std::vector<RayHit> hits;  // of the rays through pixel centres

  bool empty() const { return width <= 0 || height <= 0; }
  std::size_t index(int x, int y) const { return std::size_t(y - top) * width + (x - left); }
  const float* phi_at(std::size_t i) const { return &phi[i * basis]; }
  bool contains(int x, int y) const {
    return x >= left && x < left + width && y >= top && y < top + height;
  }
};

struct PredictionSettings {
  bool smooth_outlines = true;  // several rays where depth jumps
  int margin = 4;               // pixels of the window beyond the organ
  // The prediction holds the same level at a pose less than a pixel away: window and faces stand,
  // only the outlines are traced again.
  bool keep_faces = false;
};

// The same geometry under another light.
void relight(Prediction& prediction, const ShadingBasis::Weights& weights);

// focal_scale multiplies fx and fy. Threaded inside; the same result for any number of threads.
// `prediction` is overwritten; its memory serves again.
void predict(const RegisteredSurface& surface, const PhotoLevel& level, const ObjectPose& pose,
             double focal_scale, const ShadingBasis& basis, const ShadingBasis::Weights& weights,
             const PredictionSettings& settings, Prediction& prediction);

// The surface point of a pixel, camera mm. Beside the organ a pixel moves with the part of it that
// lies nearest; zero where none does.
Eigen::Vector3d point_near(const Prediction& prediction, int x, int y);

// d radiance of a pixel that stays where it is / d (ω, τ, ln f): what the surface point does by
// itself, minus what slides past: the picture's gradient times the motion of its points.
using PixelDerivative = Eigen::Matrix<double, 7, 1>;
PixelDerivative pixel_derivative(const Prediction& prediction, const Intrinsics& intrinsics,
                                 const Eigen::Vector3d& center_camera_mm, const ShadingBasis& basis,
                                 const ShadingBasis::Weights& weights, int x, int y);

}  // namespace organbake
