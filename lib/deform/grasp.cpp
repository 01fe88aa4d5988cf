// SPDX-License-Identifier: Apache-2.0
#include "deform/grasp.h"

#include <algorithm>
#include <tuple>

namespace organbake::deform {
namespace {

constexpr double kFarthestRadii = 2;
constexpr double kGraspRadii = 1.05;  // skin that a poke holds lies at one radius, give or take
constexpr double kSpreadRadii = 0.4;  // closer points would carry the same tissue twice
constexpr std::size_t kMostPoints = 8;

}  // namespace

void close_grasper(const TipSweep& sweep, const std::vector<std::uint32_t>& faces,
                   const ContactSearch& search, Skin& skin, std::vector<Contact>& contacts) {
  const double radius = sweep.radius_mm;
  std::vector<SkinHit> candidates;
  for (const std::uint32_t face : faces) {
    const double farthest = kFarthestRadii * radius + skin.tallest_mm(face);
    if (skin.least_distance(face, sweep.to) > farthest) continue;
    const SkinHit nearest = skin.nearest(face, sweep.to);
    if (nearest.distance_mm <= kFarthestRadii * radius) candidates.push_back(nearest);
    skin.nodes_within(face, sweep.to, kGraspRadii * radius, candidates);
  }
  const auto rank = [](const SkinHit& hit) {
    return std::tuple(hit.distance_mm, hit.at.face, hit.at.b1, hit.at.b2);
  };
  std::sort(candidates.begin(), candidates.end(),
            [&](const SkinHit& a, const SkinHit& b) { return rank(a) < rank(b); });
  const std::size_t first = contacts.size();
  for (const SkinHit& hit : candidates) {
    const std::size_t taken = contacts.size() - first;
    if (taken == kMostPoints || (taken > 0 && hit.distance_mm > kGraspRadii * radius)) break;
    const auto near_hit = [&](const Contact& c) {
      return (c.point - hit.point).norm() < kSpreadRadii * radius;
    };
    if (search.lever(hit.at).free_share == 0 ||
        std::any_of(contacts.begin() + static_cast<std::ptrdiff_t>(first), contacts.end(),
                    near_hit)) {
      continue;
    }
    Contact c;
    c.tip = sweep.tip;
    c.at = hit.at;
    c.carried = true;
    search.place(c, sweep.to);
    c.grab_offset = constrained_point(c, skin.shape(), search.rest()) - sweep.to;
    contacts.push_back(c);
  }
}

}  // namespace organbake::deform
