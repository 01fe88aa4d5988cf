// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "solver/shape_solver.h"

namespace organbake::deform {
namespace {

// What is carried takes what lies beside it along, by less than twice its own way; and tissue may
// have been away from rest before. Farther than that it goes only where grips contradict each
// other.
constexpr double kTakesAlong = 2;
constexpr double kSway = 1;     // diagonals
constexpr double kTornOff = 4;  // diagonals: farther from rest nothing can be held

double farthest_of(const Rows& x, const Rows& rest) {
  const Lanes* p = as_lanes(x.data());
  const Lanes* q = as_lanes(rest.data());
  double squared = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Lanes d = p[i] - q[i];
    if (!(dot(d, d) <= squared)) squared = dot(d, d);  // NaN stays
    if (!(squared >= 0)) break;
  }
  return std::sqrt(squared);
}

// The tip that carries with the largest force; the first one where they are not finite.
std::uint32_t most_loaded(const std::vector<Contact>& contacts) {
  std::map<std::uint32_t, Row> force;
  for (const Contact& c : contacts)
    if (c.as<Carried>()) force.try_emplace(c.instrument, Row::Zero()).first->second += c.force;
  return std::max_element(force.begin(), force.end(),
                          [](const auto& a, const auto& b) {
                            return a.second.squaredNorm() < b.second.squaredNorm();
                          })
      ->first;
}

}  // namespace

bool ShapeSolver::carries() const {
  return std::any_of(contacts_.begin(), contacts_.end(),
                     [](const Contact& c) { return c.as<Carried>() != nullptr; });
}

bool ShapeSolver::pulled_too_far() const {
  double way_mm = 0;  // of what is carried
  for (const Contact& c : contacts_)
    if (c.as<Carried>()) way_mm = std::max(way_mm, (c.target - c.anchored_at).norm());
  const double most_mm =
      std::min(kTornOff * diagonal_mm_, kSway * diagonal_mm_ + kTakesAlong * way_mm);
  const double now_mm = farthest_of(x_, tissue_->rest());
  // What lies far away from an earlier pull is no reason to let go of another.
  return !(now_mm <= std::max(most_mm, farthest_of(x_start_, tissue_->rest())));
}

// A step with graspers. Jaws hold by friction: where tissue would have to follow them beyond any
// shape, because they are too far away or contradict each other, it slips from the one that pulls
// the most, and the step is taken again from where it began.
Penetration ShapeSolver::pull(const std::vector<InstrumentSweep>& sweeps) {
  std::vector<Contact> before = contacts_;
  std::optional<TissueContacts::Sides> sides;
  if (tissue_search_) sides = tissue_search_->sides();
  Penetration deepest = move(sweeps);
  while (carries() && pulled_too_far()) {
    const std::uint32_t slips = most_loaded(contacts_);
    std::erase_if(before,
                  [slips](const Contact& c) { return c.as<Carried>() && c.instrument == slips; });
    contacts_ = before;
    if (sides) tissue_search_->go_back_to(*sides);
    x_ = x_start_;
    constraints_.reset();
    tip_too_fast_ = touched_on_the_way_ = false;
    find_faces(sweeps);
    ++slipped_;
    deepest = move(sweeps);
  }
  return deepest;
}

}  // namespace organbake::deform
