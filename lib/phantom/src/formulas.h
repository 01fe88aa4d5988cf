// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The formula of the phantom organ, and what is made of it; and what a MovingClip is made of:
// tissue and what lies on it, the instrument that crosses, and the sensor.

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "organbake/capture/solid_noise.h"
#include "organbake/capture/surface_color.h"
#include "organbake/core/random.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

struct OrganPhantomOptions;
struct Volume;

// Which random stream of the phantom's seed belongs to what. Part of the frozen formula: a changed
// number is another organ.
namespace seed_items {
inline constexpr std::uint64_t kBroadBumps = 1;
inline constexpr std::uint64_t kFineBumps = 2;
inline constexpr std::uint64_t kTexture = 3;  // the first of six noises
inline constexpr std::uint64_t kFirstLobe = 100;
inline constexpr std::uint64_t kFirstFatSpot = 200;
inline constexpr std::uint64_t kFirstScanRow = 1u << 20;  // one stream per row of voxels
}  // namespace seed_items

// Uniform over the unit sphere.
inline Eigen::Vector3d random_direction(RandomStream& random) {
  const double z = random.uniform(-1, 1), angle = random.uniform(0, 2 * std::numbers::pi);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

// The organ as a star-shaped body round `center`: with x = world − center, ρ = |x|, d = x / ρ,
//   F(x)  = r(d) − ρ                                  (> 0 inside, mm along the radius)
//   r(d)  = R(d) + a · N(R(d) d)                      (N: solid noise of two scales, a: bumps)
//   R(d)  = s R0 (1 + Σ A_k exp(κ_k (d·m_k − 1) − β_k (d·e_k)²))
// Lobes with β > 0 are drawn out across e_k. The first kNamedLobes lobes make a liver's outline,
// jittered by the seed, the rest are drawn from it. The lobes scale with s, the bumps stay in mm:
// a smaller organ has the same skin.
class OrganShape {
 public:
  OrganShape(std::uint64_t seed, double scale, const Eigen::Vector3d& center_mm);

  struct Sample {
    double value = 0;  // F
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  };
  double value(const Eigen::Vector3d& world_mm) const;
  Sample sample(const Eigen::Vector3d& world_mm) const;
  // The surface's point in a unit direction.
  Eigen::Vector3d surface_point(const Eigen::Vector3d& direction) const;

  const Eigen::Vector3d& center_mm() const { return center_mm_; }
  double scale() const { return scale_; }
  // The surface lies between two spheres round the centre, and |∇F| stays below lipschitz() near
  // it. All three are measured over the sphere at construction, with a margin.
  double inner_radius_mm() const { return inner_radius_mm_; }
  double outer_radius_mm() const { return outer_radius_mm_; }
  double lipschitz() const { return lipschitz_; }

 private:
  static constexpr int kLobes = 16;
  using LobeAxes = Eigen::Matrix<double, kLobes, 3>;
  using LobeValues = Eigen::Array<double, kLobes, 1>;

  double smooth_radius(const Eigen::Vector3d& direction) const;
  double bump(const Eigen::Vector3d& offset_mm) const;
  void measure();

  Eigen::Vector3d center_mm_;
  double scale_;
  double bump_mm_;
  LobeAxes toward_, across_;
  LobeValues height_, sharpness_, narrowness_;
  SolidNoise broad_bumps_, fine_bumps_;
  double inner_radius_mm_ = 0, outer_radius_mm_ = 0, lipschitz_ = 1;
};

// The organ's albedo as a solid texture: no seams, and its formula is the truth at every point.
// From the bottom: two tissue tones in slow drifts; lobules of 2–5 mm with paler walls; fine
// mottling; a pale and a dark network of vessels (bands along zero sets of noise); fat spots; and
// one green gallbladder that tells left from right at a glance. No detail is narrower than 1.5 mm.
class OrganTexture {
 public:
  OrganTexture(std::uint64_t seed, const OrganShape& shape);

  // Linear RGB in 0…1.
  Eigen::Vector3d albedo(const Eigen::Vector3d& world_mm) const;

 private:
  struct Spot {
    Eigen::Vector3d offset_mm;  // from the centre
    double radius_mm;
  };
  Eigen::Vector3d tissue(double drift, double lobule, double mottle) const;
  double fat(const Eigen::Vector3d& offset_mm, double ragged) const;
  double gallbladder(const Eigen::Vector3d& offset_mm, double ragged) const;

  Eigen::Vector3d center_mm_;
  double scale_;
  SolidNoise drift_, lobules_, mottling_, dark_vessels_, pale_vessels_, visibility_;
  std::vector<Spot> fat_spots_;
  Eigen::Vector3d gallbladder_at_mm_, gallbladder_axis_;
};

struct Organ {
  OrganShape shape;
  OrganTexture texture;

  // What a photograph shows of a surface point apart from highlights; linear RGB, not clamped.
  Eigen::Vector3d diffuse(const Eigen::Vector3d& world_mm, const Eigen::Vector3d& normal) const;
};

// `near_surface` brings a ray close to the surface, the formula gives the exact point.
Rgb8Image photograph_organ(const Organ& organ, const RayScene& near_surface,
                           const PosedCamera& camera, const RunContext& context);

// Two lobes of a liver, a gallbladder as half a cylinder between them and lobules of fat: a height
// field z = h(x, y) in world mm, z away from the scope. A cubic B-spline over a grid, so that
// slopes are smooth; it ends at ±kReachX_mm, ±kReachY_mm.
class TissueRelief {
 public:
  static constexpr double kReachX_mm = 95, kReachY_mm = 62;

  explicit TissueRelief(std::uint64_t seed);

  struct Height {
    double z_mm = 0, slope_x = 0, slope_y = 0;
  };
  // At rest.
  Height at(double x_mm, double y_mm) const;

  // The surface after a breath has pushed it: its height above x, y now, and where the point that
  // is now there lies at rest. The whole tissue is pushed one way, the liver by `excursion_mm`,
  // what lies farther from the diaphragm by less, down to a third.
  struct Breathed {
    Height height;
    double rest_x_mm = 0, rest_y_mm = 0;
  };
  Breathed at(double x_mm, double y_mm, double excursion_mm) const;

  // Shares of liver, gallbladder and fat at x, y at rest, which add up to 1.
  Eigen::Vector3d tissues(double x_mm, double y_mm) const;

  // Vertices `spacing_mm` apart along x and y; faces look at the scope.
  TriangleMesh surface(double spacing_mm, double excursion_mm = 0) const;

 private:
  struct Lobe {
    Eigen::Vector3d center, axes;
    double angle_rad;
  };
  struct Lobule {
    double x, y, radius, height;
  };
  // What each tissue would reach alone, before they are blended.
  struct Heights {
    double liver, gallbladder, fat;
  };
  Heights heights(double x_mm, double y_mm) const;
  double fat_mm(double x_mm, double y_mm) const;
  double blended_mm(double x_mm, double y_mm) const;

  std::uint64_t seed_;
  std::vector<Lobe> lobes_;
  std::vector<Lobule> lobules_;
  Eigen::Vector3d neck_, fundus_;  // of the gallbladder: x, y, radius; mm
  int columns_, rows_;
  std::vector<float> nodes_;  // the spline's coefficients, row by row
};

// A disc of a vessel's course over a surface, seen from above.
struct VesselSpot {
  Eigen::Vector2d center_mm;
  double radius_mm;
};

// What lies on a TissueRelief, bound to its points: the colours of the materials liver, gallbladder
// and fat, vessels that branch (0.1 to 1.1 mm wide) and a net of fine ones, and the film's
// unevenness that breaks mirror reflections up.
class TissueSkin {
 public:
  // `mottling`: how much the albedo varies, 0.1 as the materials do; 0 = even colours, no vessels.
  TissueSkin(const TissueRelief& relief, std::uint64_t seed, double mottling);

  struct Sample {
    Eigen::Vector3d albedo;     // linear
    Eigen::Vector2d film_tilt;  // slopes by which the film departs from the relief's, along x and y
  };
  // At a point of the relief at rest.
  Sample at(double x_mm, double y_mm) const;

 private:
  // Shares of full scale; a tilt's from -1 to 1.
  struct Texel {
    std::array<std::uint16_t, 3> albedo;
    std::array<std::int16_t, 2> tilt;
  };
  using Materials = std::array<std::unique_ptr<SurfaceColor>, 3>;
  void paint_row(const TissueRelief& relief, int row, std::uint64_t seed, double mottling,
                 const Materials& materials, const float* vessels);
  static Texel texel(const TissueRelief& relief, const Eigen::Vector3d& point, std::uint64_t seed,
                     double mottling, const std::array<Eigen::Vector3f, 3>& colors, double vessel);
  void paint_vessels(std::uint64_t seed, std::vector<float>& coverage) const;

  int columns_, rows_;
  std::vector<Texel> texels_;
};

// A steel shaft of 5 mm with a round end, through a fixed port at the right of the world's origin:
// between 30 and 70 % of a clip its tip comes in over the tissue, sweeps across and leaves again.
class CrossingInstrument {
 public:
  static constexpr double kDiameter_mm = 5;

  // As it stands after a share 0…1 of the clip.
  explicit CrossingInstrument(double share);

  // Where a ray (world mm) first meets it: its length, and the outward normal there. Nothing where
  // it passes.
  struct Hit {
    double length;
    Eigen::Vector3d normal;
  };
  std::optional<Hit> first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const;

  // Whether it reaches into the scene at all.
  bool inside() const { return inside_; }
  const Eigen::Vector3d& tip_mm() const { return tip_; }

 private:
  bool inside_ = false;
  Eigen::Vector3d tip_, port_;
};

// What reaches the sensor of a scope, linear; 1 is white.
struct SensorLight {
  int width = 0, height = 0;
  std::vector<Eigen::Vector3f> radiance;  // row-major

  SensorLight(int w, int h)
      : width(w), height(h), radiance(static_cast<std::size_t>(w) * h, Eigen::Vector3f::Zero()) {}
};

// The mean of what the pixels see while the scope turns about its lens by `turn_rad` (about its x
// and y axes), from half of it before to half of it after. What lies beyond the picture is taken
// from its border.
SensorLight blurred_by_turn(const SensorLight& light, const Intrinsics& lens,
                            const Eigen::Vector2d& turn_rad);

// A round stop leaves the picture's corners black.
struct ScopeSensor {
  double noise = 0.005;       // standard deviation, as a share of full scale
  double stop_radius_px = 0;  // 0 = none
  std::uint64_t seed = 1, stream = 0;
};
bool behind_stop(const ScopeSensor& sensor, int width, int height, int x, int y);
// The row's columns, first and behind the last, that lie within the stop and `beyond_px` round it.
std::pair<int, int> columns_in_stop(const ScopeSensor& sensor, double beyond_px, int width,
                                    int height, int y);
Rgb8Image exposed(const SensorLight& light, const ScopeSensor& sensor);

}  // namespace organbake
