// SPDX-License-Identifier: Apache-2.0
#include "contact/grasp.h"

#include <algorithm>
#include <tuple>

namespace organbake::deform {
namespace {

constexpr double kFarthestRadii = 2;
constexpr double kGraspRadii = 1.05;  // skin that a poke holds lies at one radius, give or take
constexpr double kSpreadRadii = 0.4;  // closer points would carry the same tissue twice
constexpr std::size_t kMostPoints = 8;

// What is free of a point's weights, and how far it gives way by its own face.
struct Shares {
  double free, gives_way;
};

Shares shares_of(const Contact& c, const ContactSearch& search, const Skin& skin) {
  const double of_face = search.response_of(c.at).free_share;
  if (!skin.smooth(c.at.face)) return {of_face, of_face};
  double free = 0;
  for (const auto& [slot, weight] : std::get<Carried>(c.kind).response.carriers)
    free += weight * search.tissue().free_share(slot);
  return {free, of_face};
}

}  // namespace

void tie_to_grasper(const PaddedVector& center, const ContactSearch& search, const Skin& skin,
                    std::vector<Contact>& contacts, std::size_t first) {
  double together = 0;  // Φ
  const auto cannot_hold = [&](Contact& c) {
    CarrierResponse& response = std::get<Carried>(c.kind).response;
    response = {skin.carriers(c.at)};
    std::erase_if(response.carriers, [&](const Carrier& carrier) {
      return carrier.weight == 0 || search.tissue().free_share(carrier.slot) == 0;
    });
    const auto [free, gives_way] = shares_of(c, search, skin);
    if (free < kMinFreeShare || gives_way == 0) return true;
    response.scale = 1 / free;
    together = std::max(together, gives_way == free ? free : gives_way * gives_way / free);
    return false;
  };
  const auto begin = contacts.begin() + static_cast<std::ptrdiff_t>(first);
  contacts.erase(std::remove_if(begin, contacts.end(), cannot_hold), contacts.end());
  for (std::size_t i = first; i < contacts.size(); ++i) {
    Contact& c = contacts[i];
    Carried& carried = std::get<Carried>(c.kind);
    carried.response.scale /= together;
    c.response.free_share = together;
    search.place(c, center);
    carried.response.fixed_at_rest = skin.smooth(c.at.face);
    carried.offset = constrained_point(c, skin.shape(), search.tissue().rest()) - center;
  }
}

void close_grasper(const InstrumentSweep& sweep, const std::vector<std::uint32_t>& faces,
                   const ContactSearch& search, Skin& skin, std::vector<Contact>& contacts) {
  const double radius = sweep.to.radius_mm;
  const PaddedVector center = padded(sweep.to.position_mm);
  std::vector<SkinHit> candidates;
  for (const std::uint32_t face : faces) {
    const double farthest = kFarthestRadii * radius + skin.tallest_mm(face);
    if (skin.least_distance(face, center) > farthest) continue;
    const SkinHit nearest = skin.nearest(face, center);
    if (nearest.distance_mm <= kFarthestRadii * radius) candidates.push_back(nearest);
    skin.nodes_within(face, center, kGraspRadii * radius, candidates);
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
    if (search.response_of(hit.at).free_share == 0 ||
        std::any_of(contacts.begin() + static_cast<std::ptrdiff_t>(first), contacts.end(),
                    near_hit)) {
      continue;
    }
    Contact c;
    c.kind = Carried{};
    c.instrument = sweep.instrument;
    c.at = hit.at;
    c.point = hit.point;
    contacts.push_back(c);
  }
  tie_to_grasper(center, search, skin, contacts, first);
}

}  // namespace organbake::deform
