// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue before a scope as a height field: cubic B-splines over a grid, so that slopes are smooth
// and known. Breath moves it by a known map.
#include "formulas.h"

#include <algorithm>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNode_mm = 0.25;
constexpr double kFatBed_mm = 70;  // of the fat from the world's origin
constexpr double kLobeBlend_mm = 5, kGallbladderBlend_mm = 2.5, kLobuleBlend_mm = 1.5;
constexpr double kFarBelow_mm = 1e3;

// The nearer of two surfaces, rounded where they meet within `width` of each other (Quilez's
// polynomial smooth minimum).
double blended_min(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - 0.25 * h * h * width;
}

// Height over the axis, this far from it; its foot does not fall quite upright, and goes on below.
double half_cylinder_mm(double away_mm, double radius_mm) {
  constexpr double kFoot = 0.97;  // of the radius
  const double foot = std::sqrt(1 - kFoot * kFoot);
  const double beyond = away_mm / radius_mm - kFoot;
  if (beyond > 0) return radius_mm * (foot - kFoot / foot * beyond);
  return std::sqrt(radius_mm * radius_mm - away_mm * away_mm);
}

// What a breath does: the direction, in y and z, and the share of its excursion by y, which falls
// smoothly from 1 at the diaphragm.
constexpr double kBreathY = 0.8, kBreathZ = -0.6;
constexpr double kDiaphragmY_mm = -40, kStillY_mm = 50, kLeastShare = 0.35;

struct Share {
  double value, slope;
};

Share breath_share(double y_mm) {
  constexpr double kWidth = kStillY_mm - kDiaphragmY_mm, kRange = 1 - kLeastShare;
  const double t = std::clamp((y_mm - kDiaphragmY_mm) / kWidth, 0.0, 1.0);
  return {1 - kRange * t * t * (3 - 2 * t), -kRange * 6 * t * (1 - t) / kWidth};
}

// Where the point that a breath has brought to y was: y = rest + excursion · share(rest).
double at_rest(double y_mm, double excursion_mm) {
  double rest = y_mm;
  for (int i = 0; i < 20; ++i) {
    const double next = y_mm - excursion_mm * kBreathY * breath_share(rest).value;
    const bool settled = std::abs(next - rest) < 1e-10;
    rest = next;
    if (settled) break;
  }
  return rest;
}

// Weights of a uniform cubic B-spline's four nodes, and their slopes by the parameter.
struct Weights {
  std::array<double, 4> value, slope;
};

Weights spline_weights(double t) {
  const double s = 1 - t;
  return {{s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6,
           t * t * t / 6},
          {-s * s / 2, (3 * t * t - 4 * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2}};
}

// The cell of a grid with nodes at 0, 1, … and the place in it; beyond it, its border.
struct Place {
  int cell;
  double within;
};

Place place_in(double coordinate, int nodes) {
  const double inside = std::clamp(coordinate, 1.0, nodes - 2.0 - 1e-9);
  const int cell = static_cast<int>(inside);
  return {cell, inside - cell};
}

}  // namespace

TissueRelief::TissueRelief(std::uint64_t seed)
    : seed_(seed),
      columns_(static_cast<int>(2 * kReachX_mm / kNode_mm) + 3),
      rows_(static_cast<int>(2 * kReachY_mm / kNode_mm) + 3) {
  RandomStream random(seed, 901);
  const auto near = [&](double value, double by) { return value + random.uniform(-by, by); };
  lobes_ = {{{near(-27, 2), near(-24, 2), 84}, {near(48, 2), near(36, 2), near(38, 1)}, 0.3},
            {{near(50, 2), near(-28, 2), 87}, {near(38, 2), near(34, 2), near(43, 1)}, -0.2}};
  neck_ = {near(4, 1), near(-16, 1), near(5.5, 0.3)};
  fundus_ = {near(18, 1), near(21, 1), near(9.5, 0.5)};
  constexpr int kLobules = 110;
  for (int i = 0; i < kLobules; ++i) {
    const double x = random.uniform(-kReachX_mm, kReachX_mm);
    const double y = random.uniform(-kReachY_mm, kReachY_mm), radius = random.uniform(5, 11);
    lobules_.push_back({x, y, radius, radius * random.uniform(0.2, 0.42)});
  }
  nodes_.resize(static_cast<std::size_t>(columns_) * rows_);
  parallel_for(0, rows_, [&](int row) {
    for (int column = 0; column < columns_; ++column) {
      const double x = (column - 1) * kNode_mm - kReachX_mm, y = (row - 1) * kNode_mm - kReachY_mm;
      nodes_[static_cast<std::size_t>(row) * columns_ + column] =
          static_cast<float>(blended_mm(x, y));
    }
  });
}

double TissueRelief::fat_mm(double x_mm, double y_mm) const {
  const double bed =
      kFatBed_mm - 0.05 * y_mm + 4 * SolidNoise(seed_ + 1, 28).value({x_mm, y_mm, 14});
  double z = bed;
  for (const Lobule& lobule : lobules_) {
    const double dx = x_mm - lobule.x, dy = y_mm - lobule.y;
    const double away2 = dx * dx + dy * dy, radius2 = lobule.radius * lobule.radius;
    if (away2 >= radius2) continue;
    const double r2 = away2 / radius2;
    const double cap = lobule.height * (1 - r2) * (1.6 - 0.6 * r2);
    z = blended_min(z, bed + kLobuleBlend_mm - cap, kLobuleBlend_mm);
  }
  return z;
}

TissueRelief::Heights TissueRelief::heights(double x_mm, double y_mm) const {
  Heights result{kFarBelow_mm, kFarBelow_mm, fat_mm(x_mm, y_mm)};
  for (const Lobe& lobe : lobes_) {
    const double c = std::cos(lobe.angle_rad), s = std::sin(lobe.angle_rad);
    const double dx = x_mm - lobe.center.x(), dy = y_mm - lobe.center.y();
    const double r2 = std::pow((c * dx + s * dy) / lobe.axes.x(), 2) +
                      std::pow((c * dy - s * dx) / lobe.axes.y(), 2);
    if (r2 < 1)
      result.liver = std::min(result.liver, lobe.center.z() - lobe.axes.z() * std::sqrt(1 - r2));
  }
  const Vector2d along = fundus_.head<2>() - neck_.head<2>(),
                 way(x_mm - neck_.x(), y_mm - neck_.y());
  const double share = std::clamp(way.dot(along) / along.squaredNorm(), 0.0, 1.0);
  const double radius = neck_.z() + share * (fundus_.z() - neck_.z());
  const double away = (way - share * along).norm();
  result.gallbladder = kFatBed_mm - 2 - half_cylinder_mm(away, radius);
  return result;
}

double TissueRelief::blended_mm(double x_mm, double y_mm) const {
  const Heights h = heights(x_mm, y_mm);
  // The capsule's own unevenness.
  const double uneven = 0.5 * SolidNoise(seed_ + 2, 9).value({x_mm, y_mm, 4.5}) +
                        0.08 * SolidNoise(seed_ + 3, 2.6).value({x_mm, y_mm, 1.3});
  return uneven + blended_min(blended_min(h.fat, h.liver, kLobeBlend_mm), h.gallbladder,
                              kGallbladderBlend_mm);
}

Vector3d TissueRelief::tissues(double x_mm, double y_mm) const {
  const Heights h = heights(x_mm, y_mm);
  constexpr double kBorder_mm = 0.4;
  // How far the first lies before the second, as a share.
  const auto before = [](double first, double second) {
    return std::clamp(0.5 + (second - first) / (2 * kBorder_mm), 0.0, 1.0);
  };
  const double gallbladder = before(h.gallbladder, std::min(h.liver, h.fat));
  const double liver = (1 - gallbladder) * before(h.liver, h.fat);
  return {liver, gallbladder, 1 - gallbladder - liver};
}

TissueRelief::Height TissueRelief::at(double x_mm, double y_mm) const {
  const Place column = place_in((x_mm + kReachX_mm) / kNode_mm + 1, columns_);
  const Place row = place_in((y_mm + kReachY_mm) / kNode_mm + 1, rows_);
  const Weights u = spline_weights(column.within), v = spline_weights(row.within);
  const float* node = &nodes_[static_cast<std::size_t>(row.cell - 1) * columns_ + column.cell - 1];
  Height height;
  for (int j = 0; j < 4; ++j, node += columns_) {
    double value = 0, slope = 0;
    for (int i = 0; i < 4; ++i) {
      value += u.value[i] * node[i];
      slope += u.slope[i] * node[i];
    }
    height.z_mm += v.value[j] * value;
    height.slope_x += v.value[j] * slope / kNode_mm;
    height.slope_y += v.slope[j] * value / kNode_mm;
  }
  return height;
}

TissueRelief::Breathed TissueRelief::at(double x_mm, double y_mm, double excursion_mm) const {
  if (excursion_mm == 0) return {at(x_mm, y_mm), x_mm, y_mm};
  const double rest_y = at_rest(y_mm, excursion_mm);
  Breathed result{at(x_mm, rest_y), x_mm, rest_y};
  const Share share = breath_share(rest_y);
  result.height.z_mm += excursion_mm * kBreathZ * share.value;
  result.height.slope_y = (result.height.slope_y + excursion_mm * kBreathZ * share.slope) /
                          (1 + excursion_mm * kBreathY * share.slope);
  return result;
}

TriangleMesh TissueRelief::surface(double spacing_mm, double excursion_mm) const {
  const int columns = static_cast<int>(2 * kReachX_mm / spacing_mm) + 1;
  const int rows = static_cast<int>(2 * kReachY_mm / spacing_mm) + 1;
  TriangleMesh mesh;
  mesh.vertices.resize(static_cast<std::size_t>(columns) * rows);
  parallel_for(0, rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      const double x = column * spacing_mm - kReachX_mm, y = row * spacing_mm - kReachY_mm;
      mesh.vertices[static_cast<std::size_t>(row) * columns + column] =
          Vector3d(x, y, at(x, y, excursion_mm).height.z_mm);
    }
  });
  mesh.faces.reserve(std::size_t(2) * (columns - 1) * (rows - 1));
  for (int row = 0; row + 1 < rows; ++row)
    for (int column = 0; column + 1 < columns; ++column) {
      const auto a = static_cast<std::uint32_t>(row * columns + column);
      const std::uint32_t b = a + 1, c = a + columns, d = c + 1;
      mesh.faces.push_back({a, d, b});
      mesh.faces.push_back({a, c, d});
    }
  return mesh;
}

}  // namespace organbake
