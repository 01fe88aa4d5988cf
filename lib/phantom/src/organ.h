// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The formula of the phantom organ, and what is made of it.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "organbake/capture/solid_noise.h"
#include "organbake/core/random.h"
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

// The scan's grid: its size and spacing as asked for, LPS axes, its centre away from the world's.
Eigen::Vector3d scan_center_mm();
Volume scan_organ(const OrganShape& shape, const OrganPhantomOptions& options,
                  const RunContext& context);

// The formula's surface over an icosphere's directions, with its diffuse colours when `texture`.
TriangleMesh organ_surface(const Organ& organ, int subdivisions, bool colored,
                           const RunContext& context);

std::vector<PosedCamera> cameras_round(const TriangleMesh& surface, int count, int size);

// `near_surface` brings a ray close to the surface, the formula gives the exact point.
Rgb8Image photograph_organ(const Organ& organ, const RayScene& near_surface,
                           const PosedCamera& camera, const RunContext& context);

}  // namespace organbake
