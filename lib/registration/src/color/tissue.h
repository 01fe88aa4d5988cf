// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "appearance/prediction.h"
#include "cost_functions/cost_functions.h"
#include "organbake/core/run_context.h"
#include "organbake/image/channel_image.h"
#include "organbake/registration/register_photo.h"
#include "organbake/registration/registered_surface.h"
#include "pose/poses.h"

namespace organbake {

// Living tissue lit from beside the lens, as logarithms: exposure, beam, vignette, fall-off and
// albedo multiply there and so add up here, and a share of the light is as much in the dark as in
// the bright. The logarithm of a point's radiance is
//   ln(cos θ / r²) + gain + tilt · (u, v) + beam · ln(1 + u² + v²) + falloff · ln r + hue · h,
// θ and r seen from the lamp, which sits `lamp` mm beside the lens; u, v normalised image
// coordinates (a beam or vignette cosⁿ of the angle to the axis has beam = −n / 2); h five numbers
// of the pixel's colour (hue_numbers): what is redder is darker, fat is yellow and bright.
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

// ln of red over green and of green over blue, of a level's pixels: no light of one colour changes
// them, so they tell of what the tissue is. Row by row; means over the pixels of the photograph
// that are not blown.
std::vector<Eigen::Vector2f> log_hues(const Rgb8Image& photo, const PhotoLevel& level);

// The hues of some pixels as numbers of about unit size: both, centred on the organ's own, their
// squares and their product. Where all has one colour they stay small, so that noise is no hue.
std::vector<TissueLight::Hues> hue_numbers(const PhotoLevel& level,
                                           const std::vector<Eigen::Vector2f>& hues,
                                           const Prediction& prediction,
                                           const std::vector<WeightedPixel>& pixels);

constexpr int kColorKinds = 5;
// How much of a pixel is of each kind; sums to 1.
using KindShares = std::array<float, kColorKinds>;

// What surrounds an organ's start in a photograph, its pixels told apart by kinds of colour.
struct ColorScene {
  PhotoLevel level;  // the lens of the piece that was cut out; no luminance
  std::vector<KindShares> kinds;
  double radius_px = 0;  // of the organ at its start

  // Nothing where the piece has next to no pixels.
  static ColorScene around(const RegisteredSurface& surface, const PhotoToRegister& photo,
                           const ObjectPose& start);
  bool empty() const { return kinds.empty(); }
};

// How much of each pixel of the piece the organ covers at a pose, blurred by a Gaussian.
std::vector<float> covered(const RegisteredSurface& surface, const PhotoLevel& level,
                           const ObjectPose& pose, double blur_px);

// How likely each pixel shows the organ, by its colour alone, when the organ is taken to cover so
// much of each. A kind that fills as much of the organ as of what surrounds it, such as something
// in front that hides both, gives 0.5: it tells nothing, for or against any pose.
std::vector<float> likely_organ(const ColorScene& scene, const std::vector<float>& cover);

// The pose near a start (20 mm and 15° off) at which the organ's silhouette covers what has its
// colours and no more: where brightness tells nothing, or its light is unlike any model. What the
// organ's colours are is learnt with the pose, coarse to fine; something in front, which takes up
// as much of the organ as of its ground, tells nothing. The pose keeps near its start as far as
// colours leave it open, so that an organ partly hidden is not taken for a smaller, farther one.
//
// A silhouette is that of other poses, too (of a mirrored organ, of one turned about a symmetry):
// the verdict is doubtful at best.
RegisteredPhoto register_by_color(const RegisteredSurface& surface, const PhotoToRegister& photo,
                                  const RigidTransform& start, const RunContext& context = {});

// Of the pyramid of a photograph of living tissue: the level that starts are tried on has between
// half as many and so many pixels on its longer side.
inline constexpr int kCoarsestTissueSide = 119;

// The pose of an open surface in a photograph of living tissue, near a start that is up to about
// 15 mm and 10° off: fits from places all round the start on the coarsest level, of which the
// likeliest are followed to finer ones. Nothing when the surface is out of the picture. Threads
// across starts; ordered and seeded, so repeatable.
std::optional<ObjectPose> search_tissue(const RegisteredSurface& surface, const Rgb8Image& photo,
                                        const std::vector<PhotoLevel>& pyramid,
                                        const ObjectPose& start, const RunContext& context);

}  // namespace organbake
