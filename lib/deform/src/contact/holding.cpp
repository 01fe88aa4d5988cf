// SPDX-License-Identifier: Apache-2.0
// How instruments hold skin beyond pushing it: graspers carry points of it until the pull is more
// than jaws hold by friction, needles go through it and it slides along them, and both go on when
// blades have made another skin. In: the sweeps, the skin as it lies. Out: contacts that last.
#include "contact/contact_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace organbake::deform {
namespace {

constexpr double kFarthestRadii = 2;
constexpr double kGraspRadii = 1.05;  // skin that a poke holds lies at one radius, give or take
constexpr double kSpreadRadii = 0.4;  // closer points would carry the same tissue twice
constexpr std::size_t kMostPoints = 8;
constexpr double kClosing_s = 0.05;  // in which jaws close to 1/e of the way

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

// Ties the points from `first` on to the tip that carries them, as the skin lies, and to each other
// (CarrierResponse). Drops those that cannot give way.
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

}  // namespace

bool close_grasper(const InstrumentSweep& sweep, const std::vector<std::uint32_t>& faces,
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
  return candidates.empty() || contacts.size() > first;
}

void close_jaws(double time_step_s, std::vector<Contact>& contacts) {
  for (Contact& c : contacts)
    if (Carried* carried = c.as<Carried>())
      carried->closed += (1 - std::exp(-time_step_s / kClosing_s)) * (1 - carried->closed);
}

namespace {

// Skin gives way to a needle that has pushed it in so far, and not beside its point.
constexpr double kPierced_mm = 4;
constexpr double kAtPoint = 0.1;  // of the needle's length

// The contact at a needle's point that has gone in farthest; none if not far enough.
const Contact* pierced(const InstrumentSweep& sweep, const std::vector<Contact>& contacts) {
  const Contact* deepest = nullptr;
  double depth_mm = kPierced_mm;
  for (const Contact& c : contacts) {
    const Pressed* pressed = c.as<Pressed>();
    if (c.instrument != sweep.instrument || !pressed || !pressed->from_front || c.force.isZero(0))
      continue;
    const double in_mm = (c.point - c.anchored_at).dot(c.normal);
    if (in_mm < depth_mm || tip_at(sweep, 1).along(c.point) > kAtPoint) continue;
    depth_mm = in_mm, deepest = &c;
  }
  return deepest;
}

}  // namespace

std::vector<Contact> let_needles_through(const std::vector<InstrumentSweep>& sweeps,
                                         std::vector<Contact>& contacts) {
  std::erase_if(contacts,
                [](const Contact& c) { return c.as<OnNeedle>() && up_needle(c, c.point) < 0; });
  std::vector<Contact> punctures;
  for (const InstrumentSweep& sweep : sweeps) {
    const Contact* pushed = sweep.to.is<Needle>() ? pierced(sweep, contacts) : nullptr;
    if (!pushed) continue;
    punctures.push_back(*pushed);
    Contact through = *pushed;
    through.kind = OnNeedle{};
    through.force.setZero();
    std::erase_if(contacts, [&](const Contact& c) { return c.instrument == sweep.instrument; });
    contacts.push_back(through);
  }
  return punctures;
}

// When jaws lose what they hold. A solver that holds a point at any price flings the rest of a body
// about once the point cannot follow; real jaws hold by friction, and slip. So a step whose shape
// went farther than its graspers can explain is taken again without the one that pulls the most.
namespace {

// What is carried takes what lies beside it along, by less than twice its own way; and tissue may
// have been away from rest before. Farther than that it goes only where graspers contradict each
// other.
constexpr double kTakesAlong = 2;
constexpr double kSway = 1;     // diagonals
constexpr double kTornOff = 4;  // diagonals: farther from rest nothing can be held

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
  const double now_mm = largest_distance(shape.now, shape.rest);
  // What lies far away from an earlier pull is no reason to let go of another.
  return !(now_mm <= std::max(most_mm, largest_distance(shape.at_start, shape.rest)));
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

// Blades make another skin, and the old contacts' faces are none of it. What lasts is found again
// by its place at rest, which a cut does not change.
namespace {

// The skin that is nearest to where the tip held it, at rest.
bool find_anew(const PaddedVector& at_rest, const ContactSearch& search, const PosedSkin& posed,
               Contact& contact) {
  Skin& skin = posed.skin;
  skin.pose(search.tissue().rest());
  contact.at = skin.nearest(at_rest).at;
  skin.pose(posed.x);
  return search.response_of(contact.at).free_share > 0;
}

}  // namespace

std::vector<HeldContact> held_contacts(const std::vector<Contact>& contacts, Skin& skin,
                                       const PaddedVectors& rest, const PaddedVectors& x) {
  std::vector<HeldContact> held;
  skin.pose(rest);
  for (const Contact& c : contacts)
    if (c.lasts()) held.push_back({c, skin.hit(c.at, PaddedVector::Zero()).point});
  skin.pose(x);
  return held;
}

void hold_anew(const std::vector<HeldContact>& held, const std::vector<Instrument>& instruments,
               const ContactSearch& search, const PosedSkin& posed,
               std::vector<Contact>& contacts) {
  const auto center_of = [&](const Contact& c) {
    return padded(instruments[c.instrument].position_mm);
  };
  std::size_t first = contacts.size();  // of those of one grasper: they stand together
  const auto tie_anew = [&] {
    if (first == contacts.size()) return;
    tie_to_grasper(center_of(contacts[first]), search, posed.skin, contacts, first);
    first = contacts.size();
  };
  for (auto [contact, at_rest] : held) {
    if (contact.instrument >= instruments.size()) continue;
    if (first < contacts.size() && contacts[first].instrument != contact.instrument) tie_anew();
    if (!find_anew(at_rest, search, posed, contact)) continue;
    const bool on_needle = contact.as<OnNeedle>() != nullptr;
    if (on_needle) search.place(contact, center_of(contact));
    contacts.push_back(contact);
    if (on_needle) first = contacts.size();
  }
  tie_anew();
}

}  // namespace organbake::deform
