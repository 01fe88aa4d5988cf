// SPDX-License-Identifier: GPL-3.0-or-later
// What lies on the tissue before a scope, painted once over the relief: the materials' colours,
// vessels that wander, taper and branch, and the tilt of the wet film.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "formulas.h"
#include "organbake/capture/solid_noise.h"
#include "organbake/capture/surface_color.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

struct Tip {
  Eigen::Vector2d at_mm;
  double heading_rad, radius_mm;
};

constexpr double kLeastRadius_mm = 0.07;
constexpr double kTaper = 0.012;      // of the radius, a step
constexpr double kWander_rad = 0.14;  // a step, standard deviation
constexpr double kFork = 0.025;       // chance of it, a step
constexpr double kChild = 0.62;       // radius of a branch by its stem's
constexpr double kForkAngle_rad = 0.7;

void grow(Tip tip, RandomStream& random, std::vector<Tip>& branches, std::vector<VesselSpot>& spots,
          const Eigen::Vector2d& reach_mm) {
  while (tip.radius_mm > kLeastRadius_mm && (tip.at_mm.cwiseAbs() - reach_mm).maxCoeff() < 0) {
    spots.push_back({tip.at_mm, tip.radius_mm});
    tip.heading_rad += kWander_rad * random.normal();
    tip.at_mm +=
        0.8 * tip.radius_mm * Eigen::Vector2d(std::cos(tip.heading_rad), std::sin(tip.heading_rad));
    tip.radius_mm *= 1 - kTaper;
    if (random.uniform() > kFork) continue;
    const double side = random.uniform() < 0.5 ? -1 : 1;
    branches.push_back({tip.at_mm,
                        tip.heading_rad + side * kForkAngle_rad * random.uniform(0.6, 1.3),
                        kChild * tip.radius_mm});
  }
}

// Vessels that wander, taper and branch within ±reach, as the discs that they cover, near enough to
// each other to leave no gap. `count` trees, whose stems are 0.3 to 2 mm wide.
std::vector<VesselSpot> grow_vessels(std::uint64_t seed, int count,
                                     const Eigen::Vector2d& reach_mm) {
  std::vector<VesselSpot> spots;
  for (int tree = 0; tree < count; ++tree) {
    RandomStream random(seed, static_cast<std::uint64_t>(tree));
    const double x = random.uniform(-reach_mm.x(), reach_mm.x());
    const double y = random.uniform(-reach_mm.y(), reach_mm.y());
    // Thin ones are the more frequent.
    const double radius = 0.15 * std::pow(6.5, std::pow(random.uniform(), 3));
    std::vector<Tip> tips = {{{x, y}, random.uniform(0, 2 * std::numbers::pi), radius}};
    while (!tips.empty()) {
      const Tip tip = tips.back();
      tips.pop_back();
      grow(tip, random, tips, spots, reach_mm);
    }
  }
  return spots;
}

}  // namespace

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::array<Tissue, 3> kTissues = {Tissue::liver, Tissue::gallbladder, Tissue::fat};
constexpr double kTexel_mm = 0.1;
constexpr int kVesselTrees = 280;
constexpr double kFullAlbedo = std::numeric_limits<std::uint16_t>::max();
constexpr double kFullTilt = std::numeric_limits<std::int16_t>::max();

// What a vessel on each leaves of its light: the liver's lie below its capsule.
const Vector3d kOnLiver(0.86, 0.84, 0.86), kOnGallbladder(0.72, 0.42, 0.42),
    kOnFat(0.72, 0.4, 0.38);
const Vector3d kUneven(1, 0.3, 0.8);  // of the film on each
constexpr double kOwnMottling = 0.1;  // that of the materials as they are

// The albedo of a material as CT organs get it: in a light of one from all sides.
std::unique_ptr<SurfaceColor> albedo_of(Tissue tissue) {
  Material material;
  material.tissue = tissue;
  material.ambient = 1;
  return make_material_color(material);
}

// Fine vessels run where a noise is zero: a net of meshes some millimetres wide.
double net_at(std::uint64_t seed, const Vector3d& point) {
  constexpr double kMesh_mm = 3.2, kHalfWidth = 0.022;
  const double away = std::abs(SolidNoise(seed, kMesh_mm).value(point));
  return std::clamp(1.5 - away / kHalfWidth, 0.0, 1.0);
}

// The film's slopes: of humps a millimetre wide and some hundredths of it high.
Vector2d film_tilt(std::uint64_t seed, const Vector3d& point) {
  constexpr double kCoarse_mm = 1.3, kCoarseHeight_mm = 0.26, kFine_mm = 0.5, kFineHeight_mm = 0.02;
  const Vector3d slope =
      kCoarseHeight_mm * SolidNoise(seed, kCoarse_mm).sample(point).gradient_per_mm +
      kFineHeight_mm * SolidNoise(seed + 1, kFine_mm).sample(point).gradient_per_mm;
  return slope.head<2>();
}

// A material's colours, as much more or less mottled as asked for about its median.
Vector3d mottled(const Eigen::Vector3f& color, const Eigen::Vector3f& median, double mottling) {
  return median.cast<double>().array() *
         (color.cwiseQuotient(median).cast<double>().array()).pow(mottling / kOwnMottling);
}

}  // namespace

TissueSkin::TissueSkin(const TissueRelief& relief, std::uint64_t seed, double mottling)
    : columns_(static_cast<int>(2 * TissueRelief::kReachX_mm / kTexel_mm) + 2),
      rows_(static_cast<int>(2 * TissueRelief::kReachY_mm / kTexel_mm) + 2),
      texels_(static_cast<std::size_t>(columns_) * rows_) {
  std::vector<float> vessels(texels_.size(), 0.0f);
  if (mottling > 0) paint_vessels(seed, vessels);
  const std::array<std::unique_ptr<SurfaceColor>, 3> materials = {
      albedo_of(kTissues[0]), albedo_of(kTissues[1]), albedo_of(kTissues[2])};
  parallel_for(0, rows_, [&](int row) {
    paint_row(relief, row, seed, mottling, materials, &vessels[std::size_t(row) * columns_]);
  });
}

void TissueSkin::paint_row(const TissueRelief& relief, int row, std::uint64_t seed, double mottling,
                           const Materials& materials, const float* vessels) {
  const auto count = static_cast<std::size_t>(columns_);
  std::vector<Vector3d> points(count), normals(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double x = static_cast<double>(k) * kTexel_mm - TissueRelief::kReachX_mm,
                 y = row * kTexel_mm - TissueRelief::kReachY_mm;
    const TissueRelief::Height height = relief.at(x, y);
    points[k] = {x, y, height.z_mm};
    normals[k] = Vector3d(height.slope_x, height.slope_y, -1).normalized();
  }
  std::array<std::vector<Eigen::Vector3f>, 3> colors;
  for (std::size_t m = 0; m < colors.size(); ++m)
    materials[m]->shade(points, normals, {}, colors[m]);
  for (std::size_t k = 0; k < count; ++k)
    texels_[static_cast<std::size_t>(row) * count + k] = texel(
        relief, points[k], seed, mottling, {colors[0][k], colors[1][k], colors[2][k]}, vessels[k]);
}

TissueSkin::Texel TissueSkin::texel(const TissueRelief& relief, const Vector3d& point,
                                    std::uint64_t seed, double mottling,
                                    const std::array<Eigen::Vector3f, 3>& colors, double vessel) {
  static const std::array<Vector3d, 3> kLeft = {kOnLiver, kOnGallbladder, kOnFat};
  const std::uint64_t stream = 64 * seed;
  const Vector3d share = relief.tissues(point.x(), point.y());
  const double net = mottling > 0 ? 0.25 * net_at(stream + 30, point) : 0;
  const double covered = std::max(vessel, net);
  Vector3d albedo = Vector3d::Zero();
  for (std::size_t m = 0; m < colors.size(); ++m)
    albedo += share[static_cast<Eigen::Index>(m)] *
              mottled(colors[m], tissue_look(kTissues[m]).albedo, mottling)
                  .cwiseProduct(Vector3d::Ones() - covered * (Vector3d::Ones() - kLeft[m]));
  const Vector2d tilt = share.dot(kUneven) * film_tilt(stream + 40, point);
  Texel result{};
  for (int c = 0; c < 3; ++c)
    result.albedo[c] =
        static_cast<std::uint16_t>(std::lround(kFullAlbedo * std::clamp(albedo[c], 0.0, 1.0)));
  for (int axis = 0; axis < 2; ++axis)
    result.tilt[axis] =
        static_cast<std::int16_t>(std::lround(kFullTilt * std::clamp(tilt[axis], -1.0, 1.0)));
  return result;
}

void TissueSkin::paint_vessels(std::uint64_t seed, std::vector<float>& coverage) const {
  constexpr double kSoft_mm = 0.09;   // half the width of a vessel's border
  constexpr double kOfRadius = 0.55;  // what of a vessel shows below the serosa
  const Vector2d reach(TissueRelief::kReachX_mm, TissueRelief::kReachY_mm);
  for (const VesselSpot& spot : grow_vessels(seed, kVesselTrees, reach)) {
    const double radius_mm = kOfRadius * spot.radius_mm;
    const Vector2d middle = (spot.center_mm + reach) / kTexel_mm;
    const double outside = (radius_mm + kSoft_mm) / kTexel_mm;
    const auto first = [&](double m) { return std::max(0, static_cast<int>(m - outside)); };
    const auto last = [&](double m, int count) {
      return std::min(count - 1, static_cast<int>(m + outside) + 1);
    };
    for (int row = first(middle.y()); row <= last(middle.y(), rows_); ++row)
      for (int column = first(middle.x()); column <= last(middle.x(), columns_); ++column) {
        const double away = kTexel_mm * std::hypot(column - middle.x(), row - middle.y());
        const double covered = std::clamp((radius_mm + kSoft_mm - away) / (2 * kSoft_mm), 0.0, 1.0);
        float& texel = coverage[static_cast<std::size_t>(row) * columns_ + column];
        texel = std::max(texel, static_cast<float>(covered));
      }
  }
}

TissueSkin::Sample TissueSkin::at(double x_mm, double y_mm) const {
  const double u = std::clamp((x_mm + TissueRelief::kReachX_mm) / kTexel_mm, 0.0, columns_ - 1.001);
  const double v = std::clamp((y_mm + TissueRelief::kReachY_mm) / kTexel_mm, 0.0, rows_ - 1.001);
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  Sample sample{Vector3d::Zero(), Vector2d::Zero()};
  for (int corner = 0; corner < 4; ++corner) {
    const int right = corner & 1, down = corner >> 1;
    const double weight = (right ? u - column : 1 - u + column) * (down ? v - row : 1 - v + row);
    const Texel& texel = texels_[static_cast<std::size_t>(row + down) * columns_ + column + right];
    for (int c = 0; c < 3; ++c) sample.albedo[c] += weight / kFullAlbedo * texel.albedo[c];
    for (int axis = 0; axis < 2; ++axis)
      sample.film_tilt[axis] += weight / kFullTilt * texel.tilt[axis];
  }
  return sample;
}

}  // namespace organbake
