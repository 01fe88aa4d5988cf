// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace organbake {

// What lights the organ in a photograph. Lambertian; gain and offset are NCC's own.
enum class LightModel {
  automatic,  // one of those below but `direction`, by what the photograph tells (light_choice.h)
  camera,     // at the camera's centre: cos θ / r²
  beam,       // near the lens; place, fall-off and beam or vignette are estimated with the pose
  direction,  // from a given direction (camera axes), far away, with some ambient light
  estimated,  // unknown and far, estimated with the pose
};
const char* name_of(LightModel model);

struct Light {
  LightModel model = LightModel::camera;               // automatic: taken for `camera`
  Eigen::Vector3d toward = -Eigen::Vector3d::UnitZ();  // surface → light, for `direction`
  double ambient = 0.2;                                // share of the light, for `direction`
};

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
  ShadingBasis(const Light& light, double reference_mm);

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
  Light light_;
  double reference2_;
  double reference_mm_;
  int size_;
};

}  // namespace organbake
