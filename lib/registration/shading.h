// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace organbake {

// What lights the organ in a photograph. Lambertian; gain and offset are NCC's own.
enum class LightModel {
  camera,     // at the camera's centre: cos θ / r²
  direction,  // from a given direction (camera axes), far away, with some ambient light
  estimated,  // unknown and far, estimated with the pose: all of what follows with free weights
};

struct Light {
  LightModel model = LightModel::camera;
  Eigen::Vector3d toward = -Eigen::Vector3d::UnitZ();  // surface → light, for `direction`
  double ambient = 0.2;                                // share of the light, for `direction`
};

// The predicted radiance of a surface point is Σ weight_j · φ_j(x, n) with x the point and n its
// unit normal, both in camera axes. The last φ, the background, is 1 beside the organ and 0 on it.
// An estimated light has the eight spherical harmonics of degree 1 and 2 that together carry 99 %
// of any irradiance (Ramamoorthi & Hanrahan 2001), beside the lamp at the camera; degree 0 is what
// the background and NCC's offset stand for.
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
  int size_;
};

}  // namespace organbake
