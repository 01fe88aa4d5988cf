// SPDX-License-Identifier: Apache-2.0
// When jaws lose what they hold. A solver that holds a point at any price flings the rest of a body
// about once the point cannot follow; real jaws hold by friction, and slip. So a step whose shape
// went farther than its graspers can explain is taken again without the one that pulls the most.
#include "contact/pull.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace organbake::deform {
namespace {

// What is carried takes what lies beside it along, by less than twice its own way; and tissue may
// have been away from rest before. Farther than that it goes only where graspers contradict each
// other.
constexpr double kTakesAlong = 2;
constexpr double kSway = 1;     // diagonals
constexpr double kTornOff = 4;  // diagonals: farther from rest nothing can be held

double farthest_of(const PaddedVectors& x, const PaddedVectors& rest) {
  const Double4* p = as_double4(x.data());
  const Double4* q = as_double4(rest.data());
  double squared = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Double4 d = p[i] - q[i];
    if (!(dot(d, d) <= squared)) squared = dot(d, d);  // NaN stays
    if (!(squared >= 0)) break;
  }
  return std::sqrt(squared);
}

}  // namespace

bool any_carried(const std::vector<Contact>& contacts) {
  return std::any_of(contacts.begin(), contacts.end(),
                     [](const Contact& c) { return c.as<Carried>() != nullptr; });
}

bool pulled_too_far(const std::vector<Contact>& contacts, const PulledShape& shape) {
  double way_mm = 0;  // of what is carried
  for (const Contact& c : contacts)
    if (c.as<Carried>()) way_mm = std::max(way_mm, (c.target - c.anchored_at).norm());
  const double most_mm =
      std::min(kTornOff * shape.diagonal_mm, kSway * shape.diagonal_mm + kTakesAlong * way_mm);
  const double now_mm = farthest_of(shape.now, shape.rest);
  // What lies far away from an earlier pull is no reason to let go of another.
  return !(now_mm <= std::max(most_mm, farthest_of(shape.at_start, shape.rest)));
}

std::optional<std::uint32_t> overloaded(const std::vector<Contact>& contacts, const Tissue& tissue,
                                        const GraspStrengths& strength_n) {
  struct Grasp {
    PaddedVector force_mn = PaddedVector::Zero();
    double strength_mn = std::numeric_limits<double>::infinity();  // of the weakest that it holds
    double load() const { return force_mn.norm() / strength_mn; }
  };
  std::map<std::uint32_t, Grasp> grasps;
  for (const Contact& c : contacts) {
    if (!c.as<Carried>()) continue;
    Grasp& grasp = grasps[c.instrument];
    grasp.force_mn += c.felt_force();
    const double strength = strength_n[tissue.organ_of_face(c.at.face)];
    if (strength > 0)
      grasp.strength_mn = std::min(grasp.strength_mn, kMilliNewtonPerNewton * strength);
  }
  std::optional<std::uint32_t> most;
  for (const auto& [instrument, grasp] : grasps)
    if (grasp.load() > (most ? grasps[*most].load() : 1)) most = instrument;
  return most;
}

std::uint32_t most_loaded(const std::vector<Contact>& contacts) {
  std::map<std::uint32_t, PaddedVector> force;
  for (const Contact& c : contacts)
    if (c.as<Carried>())
      force.try_emplace(c.instrument, PaddedVector::Zero()).first->second += c.force;
  return std::max_element(force.begin(), force.end(),
                          [](const auto& a, const auto& b) {
                            return a.second.squaredNorm() < b.second.squaredNorm();
                          })
      ->first;
}

}  // namespace organbake::deform
