// SPDX-License-Identifier: GPL-3.0-or-later
// Thin plates (Duchon 1977) in the space of places and directions, and the directions of that space
// in which their centres spread: affine functions along others would be extrapolated from next to
// nothing.
#include "baking.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Directions in which places spread by less than this share of all their spread carry no affine
// part: they would be extrapolated from next to nothing.
constexpr double kFlat = 0.1;
// A plate gives way to its places by this share of its size cubed: two of them that nearly coincide
// would otherwise bend it as if what lies between them went on.
constexpr double kYielding = 1e-4;

// The directions in which samples spread, the widest first, one by column.
MatrixXd wide_axes(const MatrixXd& samples, double least_spread_mm) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> principal(samples * samples.transpose() /
                                                          double(samples.cols()));
  Eigen::Index count = 0;
  const Eigen::Index all = samples.rows();
  while (count < all &&
         principal.eigenvalues()[all - 1 - count] > least_spread_mm * least_spread_mm)
    ++count;
  return principal.eigenvectors().rightCols(count);
}

}  // namespace

PlateSpace::PlateSpace(const std::vector<DirectedPlace>& through, const DirectedPlace& center,
                       double twist_mm)
    : center_(center) {
  const auto count = static_cast<Eigen::Index>(through.size());
  MatrixXd places(3, count), normals(3, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    places.col(k) = through[k].at_mm;
    normals.col(k) = twist_mm * through[k].normal;
  }
  const Vector3d mean_place = places.rowwise().mean(), mean_normal = normals.rowwise().mean();
  places.colwise() -= mean_place;
  normals.colwise() -= mean_normal;
  const double least_mm = kFlat * std::sqrt(places.squaredNorm() / double(count));
  place_axes_ = wide_axes(places, least_mm).transpose();
  const MatrixXd along = place_axes_ * places;
  // What of the normals follows from the places, by least squares.
  const MatrixXd normal_from_place =
      normals * along.transpose() *
      (along * along.transpose()).completeOrthogonalDecomposition().pseudoInverse();
  const MatrixXd normal_axes = wide_axes(normals - normal_from_place * along, least_mm).transpose();
  normal_axes_ = twist_mm * normal_axes;
  place_in_normal_ = normal_axes * normal_from_place * place_axes_;
}

VectorXd PlateSpace::operator()(const DirectedPlace& place) const {
  const Vector3d away_mm = place.at_mm - center_.at_mm;
  VectorXd in_space(dimensions());
  in_space.head(place_axes_.rows()) = place_axes_ * away_mm;
  in_space.tail(normal_axes_.rows()) =
      normal_axes_ * (place.normal - center_.normal) - place_in_normal_ * away_mm;
  return in_space;
}

ThinPlate::ThinPlate(const std::vector<DirectedPlace>& through, double twist_mm, double reach_mm)
    : center_(through.front()), twist_mm_(twist_mm), reach_mm_(reach_mm) {
  for (const DirectedPlace& s : through)
    size_mm_ = std::max(size_mm_, (s.at_mm - center_.at_mm).norm());
  if (!(size_mm_ > 0)) size_mm_ = 1;
  space_ = PlateSpace(through, center_, twist_mm);
  for (const DirectedPlace& s : through) through_.push_back(space_(s) / size_mm_);
  solve();
}

double ThinPlate::share(const DirectedPlace& place) const {
  const double squared_mm = (place.at_mm - center_.at_mm).squaredNorm() +
                            twist_mm_ * twist_mm_ * (place.normal - center_.normal).squaredNorm();
  const double t = std::sqrt(squared_mm) / reach_mm_;
  if (!(t < 1)) return 0;
  const double left = (1 - t) * (1 - t);
  return left * left * (4 * t + 1);
}

VectorXd ThinPlate::weights(const DirectedPlace& place) const {
  return inverse_.topRows(static_cast<Eigen::Index>(through_.size())) *
         functions(space_(place) / size_mm_);
}

// The kernel about each place, then the affine functions.
VectorXd ThinPlate::functions(const VectorXd& place) const {
  const auto count = static_cast<Eigen::Index>(through_.size());
  VectorXd values(count + 1 + place.size());
  for (Eigen::Index k = 0; k < count; ++k) {
    const double r2 = (place - through_[k]).squaredNorm();
    values[k] = r2 * std::sqrt(r2);
  }
  values[count] = 1;
  values.tail(place.size()) = place;
  return values;
}

void ThinPlate::solve() {
  const auto count = static_cast<Eigen::Index>(through_.size());
  const Eigen::Index all = count + 1 + space_.dimensions();
  MatrixXd equations = MatrixXd::Zero(all, all);
  for (Eigen::Index k = 0; k < count; ++k) {
    const VectorXd values = functions(through_[k]);
    equations.col(k) = values;
    equations.row(k) = values.transpose();
  }
  for (Eigen::Index k = 0; k < count; ++k) equations(k, k) += kYielding;
  // Ranks may be short: fewer places than affine functions, or places that coincide.
  inverse_ = equations.completeOrthogonalDecomposition().pseudoInverse();
}

}  // namespace organbake
