// SPDX-License-Identifier: Apache-2.0
// Whether positions from another program can be a state of this organ. Wrong units, another mesh or
// another order of the vertices show in the size, the place and the length of edges, and the
// message says which is likely.
#include "plausible_places.h"

#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr double kFarthestDiagonals =
    10;  // diagonals from rest: the solver's own limit for a lost state
// Tissue tears before it is 2 or 3 times as long; places that are another mesh's have edges from
// anywhere to anywhere.
constexpr double kMostStretch = 4, kLeastStretch = 0.2;
constexpr double kMetresStretch = 1e-3, kCentimetresStretch = 0.1;

struct Box {
  Eigen::Vector3d low, high;

  explicit Box(const std::vector<Eigen::Vector3d>& places) : low(places.front()), high(low) {
    for (const Eigen::Vector3d& p : places) low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  Eigen::Vector3d center() const { return 0.5 * (low + high); }
  double diagonal() const { return (high - low).norm(); }
};

// "; are they metres?" where their size says so.
std::string unit_question(double stretch) {
  const auto near = [stretch](double wanted) {
    return stretch > 0.6 * wanted && stretch < 1.7 * wanted;
  };
  if (near(kMetresStretch)) return "; are they in metres? It takes millimetres";
  if (near(kCentimetresStretch)) return "; are they in centimetres? It takes millimetres";
  return "; they are not of this organ, or not in millimetres";
}

}  // namespace

void PlausiblePlaces::begin(std::string what, const std::vector<Eigen::Vector3d>& rest_mm) {
  what_ = std::move(what);
  const Box box(rest_mm);
  center_mm_ = box.center();
  diagonal_mm_ = box.diagonal();
  edges_mm_ = edges_mm(rest_mm);
}

double PlausiblePlaces::edges_mm(const std::vector<Eigen::Vector3d>& places_mm) const {
  double sum = 0;
  for (const auto& [a, b] : edges_) sum += (places_mm[b] - places_mm[a]).norm();
  return sum / double(edges_.size());
}

void PlausiblePlaces::check(const std::vector<Eigen::Vector3d>& now_mm) const {
  const Box box(now_mm);
  const double size = box.diagonal() / diagonal_mm_, stretch = edges_mm(now_mm) / edges_mm_;
  if (!(size > kLeastStretch && size < kFarthestDiagonals)) {
    throw UsageError("the " + what_ + " span " + to_text(box.diagonal(), 3) + " mm, and at rest " +
                     to_text(diagonal_mm_, 3) + " mm" + unit_question(size));
  }
  const double away_mm = (box.center() - center_mm_).norm();
  if (!(away_mm <= kFarthestDiagonals * diagonal_mm_)) {
    throw UsageError("the " + what_ + " lie " + to_text(away_mm, 3) +
                     " mm from their rest, the organ is " + to_text(diagonal_mm_, 3) +
                     " mm large; they are not of this organ, or of another world");
  }
  if (!(stretch > kLeastStretch && stretch < kMostStretch)) {
    throw UsageError("the edges between the " + what_ + " are " + to_text(stretch, 3) +
                     " times as long as at rest; they are in another order, or another organ's");
  }
}

}  // namespace organbake
