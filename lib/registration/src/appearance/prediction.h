// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"
#include "organbake/registration/register_photo.h"
#include "organbake/registration/registered_surface.h"

namespace organbake {

// The predicted radiance of a surface point is Σ weight_j · φ_j(x, n) with x the point and n its
// unit normal, both in camera axes. The last φ, the background, is 1 beside the organ and 0 on it.
// An estimated light has the eight spherical harmonics of degree 1 and 2 that together carry 99 %
// of any irradiance (Ramamoorthi & Hanrahan 2001), beside the lamp at the camera; degree 0 is what
// the background and NCC's offset stand for.
// A beam is the lamp at the camera, L = cos θ / r², times 1, u, v, u² + v² (normalised image
// coordinates: a tilted beam, and one that weakens to the sides or a vignette) and ln r (another
// fall-off), and the slopes of L by the lamp's place along x and y: to first order every lamp that
// is near the lens compared with its distance to the organ.
class ShadingBasis {
 public:
  static constexpr int kMost = 10;
  using Weights = Eigen::Matrix<double, kMost, 1>;

  // reference_mm makes the falloff 1 at that distance.
  ShadingBasis(LightModel light, double reference_mm);

  int size() const { return size_; }  // the background is number size() − 1
  Weights first_weights() const;
  void values(const Eigen::Vector3d& x, const Eigen::Vector3d& n, double* phi) const;
  // Gradients of the weighted sum by x and by n (as if the three parts of n were free).
  struct Gradient {
    Eigen::Vector3d by_point = Eigen::Vector3d::Zero(), by_normal = Eigen::Vector3d::Zero();
  };
  Gradient gradient(const Eigen::Vector3d& x, const Eigen::Vector3d& n,
                    const Weights& weights) const;

 private:
  LightModel light_;
  double reference2_;
  double reference_mm_;
  int size_;
};

// One level of a photograph's pyramid: linear luminance, and which pixels count.
struct PhotoLevel {
  int factor = 1;  // of the photograph's pixels per pixel here, along a side
  Intrinsics intrinsics;
  std::vector<float> luminance;       // row-major; 0…1
  std::vector<std::uint8_t> valid;    // 0 or 1
  std::vector<Eigen::Vector3f> rays;  // camera axes, z = 1, through pixel centres

  std::size_t index(int x, int y) const { return std::size_t(y) * intrinsics.width + x; }
};

// Which pixels of a photograph are not in the black border of a round field of view, and not black
// in `mask` (8-bit RGB of the photograph's size; nothing when empty).
std::vector<std::uint8_t> pixels_in_field(const Rgb8Image& photo, const Rgb8Image& mask);
// Those of them that count: neither blown out nor next to a pixel that is.
std::vector<std::uint8_t> valid_pixels(const Rgb8Image& photo, const Rgb8Image& mask);

// Levels of factor 1, 2, 4 … each the mean of 2×2 pixels of the one before, the sensor's own way of
// seeing coarsely; down to `coarsest_side` pixels on the longer side. A level is coarse[i]; the
// finest one has at most `finest_side` pixels on its longer side. Fewer than 8 pixels a side are
// no level: a photo too small for one gives none.
std::vector<PhotoLevel> photo_pyramid(const Rgb8Image& photo, const Rgb8Image& mask,
                                      const Intrinsics& intrinsics, int finest_side,
                                      int coarsest_side);

// Rays through the pixel centres of a lens, row by row.
std::vector<Eigen::Vector3f> pixel_rays(const Intrinsics& intrinsics);

// 1 inside the round field of view of an endoscope, 0 in its black border; all 1 when the picture
// has no such border. The field is found as a circle: seen from the picture's centre, the outermost
// pixels that are not black lie on one, cut by the picture's edges at most. A dark background
// round an organ is no border: its outline is no circle, or far too small a one.
std::vector<std::uint8_t> inside_round_field(const Rgb8Image& photo);

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
