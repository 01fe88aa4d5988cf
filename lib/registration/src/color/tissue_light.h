// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace organbake {

// Living tissue lit from beside the lens, as logarithms: exposure, beam, vignette, fall-off and
// albedo multiply there and so add up here, and a share of the light is as much in the dark as in
// the bright. The logarithm of a point's radiance is
//   ln(cos θ / r²) + gain + tilt · (u, v) + beam · ln(1 + u² + v²) + falloff · ln r + hue · h,
// θ and r seen from the lamp, which sits `lamp` mm beside the lens; u, v normalised image
// coordinates (a beam or vignette cosⁿ of the angle to the axis has beam = −n / 2); h five numbers
// of the pixel's colour (tissue_colors.h): what is redder is darker, fat is yellow and bright.
struct TissueLight {
  // Numbers of the pose (motion, 6) are apart.
  enum Weight : int { kGain, kLampX, kLampY, kTiltU, kTiltV, kBeam, kFalloff, kGround, kHue };
  static constexpr int kHues = 5, kShape = kGround, kSize = kHue + kHues;
  using Weights = Eigen::Matrix<double, kSize, 1>;
  using Hues = Eigen::Matrix<double, kHues, 1>;

  // What is expected before a photograph is seen, and how surely: endoscopes are alike.
  struct Expected {
    Weights mean, sd;
  };
  static Expected expected();
};

// ln radiance without the hue's part, of a point and its unit normal in camera axes; 0 for what
// faces a lamp at the lens from reference_mm.
double log_radiance(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                    const TissueLight::Weights& weights, double reference_mm);

struct LogRadianceSlopes {
  Eigen::Vector3d by_point, by_normal;                      // as if the parts of n were free
  Eigen::Matrix<double, TissueLight::kShape, 1> by_weight;  // gain to falloff
};
LogRadianceSlopes log_radiance_slopes(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                      const TissueLight::Weights& weights, double reference_mm);

}  // namespace organbake
