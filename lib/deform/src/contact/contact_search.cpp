// SPDX-License-Identifier: Apache-2.0
// Finds the places where tips press into the skin. First the faces near each tip's way through the
// step, by boxes; then on each of them the deepest point, which becomes a contact or moves one that
// is there already.
#include "contact/contact_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace organbake::deform {
namespace {

// Share of the radius: how far the skin may move between two broad phases.
constexpr double kReachMargin = 0.5;
// Share of the radius: nearer points count as one contact that has moved.
constexpr double kMergeWithin = 0.1;
// Below this cosine between the push and the skin's normal a point slides past the tip's flank.
constexpr double kFlankCosine = 0.3;
// A face is judged to lie behind the tip only when the tip stands squarely behind it.
constexpr double kSquareCosine = 0.5;
// Of a capsule's deepest point on a face: how often and how closely, in radii, it is sought.
constexpr int kMostAlternations = 8;
constexpr double kAlternationWithin = 1e-3;
// Friction between a needle's shaft and what it went through, per mm of it below the skin.
constexpr double kFriction_mn_per_mm = 20;

// The unit direction of the push and its signed clearance (negative inside the tip). A tip on the
// wrong side of the skin pushes it back along the skin's normal: it came through, not round.
struct Push {
  PaddedVector normal;
  double clearance_mm;
  double cosine;  // 1: the tip stands squarely on its side of the skin, < 0: on the wrong side
};

Push push_of(const SkinHit& hit, const PaddedVector& center, double radius_mm, bool from_front) {
  const PaddedVector away = hit.point - center;
  const double side = from_front ? 1 : -1;
  const double before = -side * away.dot(hit.normal);
  const PaddedVector normal =
      before > 0 ? PaddedVector(away / hit.distance_mm) : PaddedVector(-side * hit.normal);
  return {normal, normal.dot(away) - radius_mm,
          hit.distance_mm > 0 ? before / hit.distance_mm : -1};
}

}  // namespace

ContactSearch::ContactSearch(Skin& skin, const Tissue& tissue)
    : skin_(skin), tissue_(tissue), front_mark_(tissue.size(), 0) {}

void ContactSearch::find_faces(const PaddedVectors& x, const std::vector<InstrumentSweep>& sweeps) {
  near_.resize(sweeps.size());
  if (sweeps.empty()) return;
  beyond_.resize(x.size());
  if (skin_.smooth()) keep_boxes(x);
  const auto& faces = skin_.faces();
  for (std::size_t s = 0; s < sweeps.size(); ++s) {
    near_[s].clear();
    const Instrument &tip_from = sweeps[s].from, &tip_to = sweeps[s].to;
    const double reach = (tip_to.is<Grasper>() ? 2 : 1 + kReachMargin) * tip_to.radius_mm;
    const PaddedVector from = padded(tip_from.position_mm), from_end = padded(tip_from.end_mm());
    const PaddedVector to = padded(tip_to.position_mm), to_end = padded(tip_to.end_mm());
    const PaddedVector low = from.cwiseMin(to).cwiseMin(from_end).cwiseMin(to_end).array() - reach;
    const PaddedVector high = from.cwiseMax(to).cwiseMax(from_end).cwiseMax(to_end).array() + reach;
    mark_beyond(x, low.array() - skin_.tallest_mm(), high.array() + skin_.tallest_mm());
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
      if (skin_.smooth(f)) {
        const bool beyond = (boxes_[f].low.array() > high.array()).any() ||
                            (boxes_[f].high.array() < low.array()).any();
        if (!beyond) near_[s].push_back(f);
        continue;
      }
      // Most faces lie on one side of the box with all corners, even under the tallest skin.
      if (beyond_[faces[f][0]] & beyond_[faces[f][1]] & beyond_[faces[f][2]]) continue;
      const PaddedVector& a = x[faces[f][0]];
      const PaddedVector& b = x[faces[f][1]];
      const PaddedVector& c = x[faces[f][2]];
      const double tall = skin_.tallest_mm(f);
      const bool beyond = ((a.cwiseMin(b).cwiseMin(c).array() - tall) > high.array()).any() ||
                          ((a.cwiseMax(b).cwiseMax(c).array() + tall) < low.array()).any();
      if (!beyond) near_[s].push_back(f);
    }
  }
}

// Carrying all of a skin takes as long as a solve: a face's box has some slack, and holds until
// what carries the face has used it up.
void ContactSearch::keep_boxes(const PaddedVectors& x) {
  constexpr double kSlack_mm = 1;
  if (boxes_.empty()) {
    boxes_.resize(skin_.faces().size());
    slack_left_mm_.assign(boxes_.size(), -1);
    x_of_boxes_ = x;
  }
  moved_mm_.resize(x.size());
  for (std::size_t v = 0; v < x.size(); ++v) moved_mm_[v] = (x[v] - x_of_boxes_[v]).norm();
  x_of_boxes_ = x;
  skin_.pose(x);
  for (std::uint32_t f = 0; f < boxes_.size(); ++f) {
    double farthest_mm = 0;
    for (const std::uint32_t slot : skin_.carriers(f))
      farthest_mm = std::max(farthest_mm, moved_mm_[slot]);
    slack_left_mm_[f] -= skin_.leverage(f) * farthest_mm;
    if (!skin_.smooth(f) || slack_left_mm_[f] >= 0) continue;
    boxes_[f] = skin_.node_box(f);
    boxes_[f].low.array() -= kSlack_mm;
    boxes_[f].high.array() += kSlack_mm;
    slack_left_mm_[f] = kSlack_mm;
  }
}

// One bit for each side of the box that a vertex lies beyond.
void ContactSearch::mark_beyond(const PaddedVectors& x, const PaddedVector& low,
                                const PaddedVector& high) {
  const Double4* at = as_double4(x.data());
  const Double4 lowest = *as_double4(&low), highest = *as_double4(&high);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto under = at[i]<lowest, over = at[i]> highest;
    beyond_[i] = static_cast<std::uint8_t>((under[0] & 1) | (under[1] & 2) | (under[2] & 4) |
                                           (over[0] & 8) | (over[1] & 16) | (over[2] & 32));
  }
}

// Half of the margin; the other half is for the motion that the next solve makes.
double ContactSearch::slack_mm(const std::vector<InstrumentSweep>& sweeps) {
  double least_radius = std::numeric_limits<double>::infinity();
  for (const InstrumentSweep& sweep : sweeps)
    least_radius = std::min(least_radius, sweep.to.radius_mm);
  return kReachMargin / 2 * least_radius;
}

bool ContactSearch::found_any() const {
  return std::any_of(near_.begin(), near_.end(), [](const auto& faces) { return !faces.empty(); });
}

Eigen::Vector3d ContactSearch::way_out(const Instrument& tip) const {
  constexpr int kMostRounds = 8, kAlongAxis = 8;
  const int pieces = tip.axis_mm.isZero(0) ? 0 : kAlongAxis;
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  for (int round = 0; round < kMostRounds; ++round) {
    PaddedVector deepest_at;
    SkinHit deepest;
    for (int i = 0; i <= pieces; ++i) {
      const PaddedVector at =
          padded(tip.position_mm + way + (pieces ? double(i) / pieces : 0) * tip.axis_mm);
      if (!skin_.encloses(at)) continue;
      const SkinHit hit = skin_.nearest(at);
      if (hit.distance_mm > deepest.distance_mm) deepest = hit, deepest_at = at;
      if (tip.is<Needle>()) break;
    }
    const bool free = round > 0 ? deepest.distance_mm == 0 : deepest.distance_mm < tip.radius_mm;
    if (free) return way;
    // No way out is given to a whole organ that hangs on nothing: it would be flung away.
    const Tissue::Piece& piece = tissue_.pieces()[tissue_.piece_of_face(deepest.at.face)];
    if (!piece.held && !piece.cut) return Eigen::Vector3d::Zero();
    const double reach_mm = deepest.distance_mm + tip.radius_mm;
    const PaddedVector out = (deepest.point - deepest_at) / deepest.distance_mm;
    way += tip.is<Needle>() ? Eigen::Vector3d(reach_mm * tip.axis_mm.normalized())
                            : Eigen::Vector3d(reach_mm * out.head<3>());
  }
  return Eigen::Vector3d::Zero();  // of skin that is inside out nothing tells the way
}

double ContactSearch::refresh(const std::vector<InstrumentSweep>& sweeps, double fraction,
                              std::vector<Contact>& contacts) {
  double deepest = 0;
  for (std::size_t s = 0; s < sweeps.size(); ++s) {
    const InstrumentSweep& sweep = sweeps[s];
    const TipPose tip = tip_at(sweep, fraction);
    ++mark_;
    std::erase_if(contacts, [&](Contact& c) {
      if (Pressed* pressed = c.as<Pressed>()) pressed->just_found = false;
      return c.instrument == sweep.instrument && !update(tip, c);
    });
    touches_.clear();
    const bool on_needle = std::any_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
      return c.as<OnNeedle>() && c.instrument == sweep.instrument;
    });
    if (!sweep.to.is<Grasper>() && !on_needle) {
      for (const std::uint32_t face : near_[s]) touch(sweep, tip, face);
    }
    std::sort(touches_.begin(), touches_.end(), [](const Touch& p, const Touch& q) {
      return std::pair(q.depth_mm, p.hit.at.face) < std::pair(p.depth_mm, q.hit.at.face);
    });
    for (const Touch& t : touches_) admit(sweep, fraction, t, contacts);
    for (Contact& c : contacts) {
      if (c.instrument != sweep.instrument) continue;
      if (const Pressed* pressed = c.as<Pressed>(); pressed && pressed->just_found) update(tip, c);
      c.tip_motion = (fraction - c.touched_at) * padded(sweep.motion_mm(tip.along(c.point)));
      deepest = std::max(deepest, violation(c));
    }
    for (const Touch& t : touches_) {
      if (t.free_share == 1) deepest = std::max(deepest, t.depth_mm);
    }
  }
  return deepest;
}

PaddedVector ContactSearch::anchored(const SkinPoint& at, const PaddedVector& point) const {
  const Face& f = skin_.faces()[at.face];
  return anchored(std::array<Carrier, 3>{{{f[0], 1 - at.b1 - at.b2}, {f[1], at.b1}, {f[2], at.b2}}},
                  point);
}

PaddedVector ContactSearch::anchored(std::span<const Carrier> carriers, PaddedVector point) const {
  for (const auto& [slot, weight] : carriers)
    point -= weight * (skin_.shape()[slot] - tissue_.rest()[slot]);
  return point;
}

SkinHit ContactSearch::place(Contact& contact, const PaddedVector& center) const {
  const SkinHit hit = skin_.hit(contact.at, center);
  contact.point = hit.point;
  if (const Carried* carried = contact.as<Carried>()) {
    if (carried->response.fixed_at_rest) return hit;
    contact.anchored_at = anchored(carried->response.carriers, hit.point);
    return hit;
  }
  contact.response = response_of(contact.at);
  contact.movers.clear();
  if (skin_.smooth(contact.at.face) && contact.response.free_share == 1)
    contact.movers = skin_.carriers(contact.at);
  contact.anchored_at = contact.movers.empty() ? anchored(contact.at, hit.point)
                                               : anchored(contact.movers, hit.point);
  return hit;
}

// False for a point that has slid to the tip's flank: pushing it sideways would only stretch the
// skin, and if it still matters the search finds its neighbours.
bool ContactSearch::update(const TipPose& tip, Contact& contact) {
  SkinHit hit = place(contact, tip.center);
  if (const Carried* carried = contact.as<Carried>()) {
    contact.target = tip.center + carried->offset;
    contact.normal = hit.normal;
    return true;
  }
  if (OnNeedle* on_needle = contact.as<OnNeedle>()) {
    contact.normal = tip.axis.normalized();
    contact.target = tip.center;
    on_needle->most_friction_mn =
        kFriction_mn_per_mm * std::max(0.0, up_needle(contact, contact.point));
    return true;
  }
  const bool from_front = std::get<Pressed>(contact.kind).from_front;
  const PaddedVector center = tip.center_near(hit.point);
  hit.distance_mm = (hit.point - center).norm();
  const Push push = push_of(hit, center, tip.radius_mm, from_front);
  contact.normal = push.normal;
  contact.target = center + tip.radius_mm * push.normal;
  if (from_front) {
    for (const std::uint32_t slot : skin_.faces()[contact.at.face]) front_mark_[slot] = mark_;
  }
  return std::abs(push.cosine) > kFlankCosine;
}

bool ContactSearch::borders_front(std::uint32_t face) const {
  const Face& f = skin_.faces()[face];
  return std::any_of(f.begin(), f.end(),
                     [this](std::uint32_t slot) { return front_mark_[slot] == mark_; });
}

VertexResponse ContactSearch::response_of(const SkinPoint& at) const {
  VertexResponse response;
  std::copy_n(skin_.faces()[at.face].begin(), 3, response.slots.begin());
  const double b[3] = {1 - at.b1 - at.b2, at.b1, at.b2};
  bool whole = true;
  for (int k = 0; k < 3; ++k) {
    const double share = tissue_.free_share(response.slots[k]);
    response.free_share += share * b[k];
    whole = whole && share == 1;
  }
  if (whole) response.free_share = 1;
  if (response.free_share < kMinFreeShare) {
    response.free_share = 0;
    return response;
  }
  for (int k = 0; k < 3; ++k) {
    if (tissue_.free_share(response.slots[k]) == 0) continue;
    response.weights[k] = b[k] / (response.free_share * response.free_share);
  }
  return response;
}

double ContactSearch::violation(const Contact& contact) const {
  if (const Carried* carried = contact.as<Carried>()) {  // as far as its carriers have moved it
    const PaddedVector moved = contact.point - contact.anchored_at;
    return (contact.anchored_at + carried->response.scale * moved - contact.target).norm();
  }
  const PaddedVector miss =
      constrained_point(contact, skin_.shape(), tissue_.rest()) - contact.target;
  if (contact.as<OnNeedle>()) return (miss - contact.normal.dot(miss) * contact.normal).norm();
  return -contact.normal.dot(miss);
}

// Nearest points of skin and axis in turn, which closes in on a common pair.
SkinHit ContactSearch::deepest(const TipPose& tip, std::uint32_t face, PaddedVector& center) {
  const auto [i, j, k] = skin_.faces()[face];
  center = tip.center_near((skin_.shape()[i] + skin_.shape()[j] + skin_.shape()[k]) / 3);
  SkinHit hit = skin_.nearest(face, center);
  for (int round = 0; round < kMostAlternations && !tip.axis.isZero(0); ++round) {
    const PaddedVector next = tip.center_near(hit.point);
    if ((next - center).norm() < kAlternationWithin * tip.radius_mm) break;
    center = next;
    hit = skin_.nearest(face, center);
  }
  return hit;
}

void ContactSearch::touch(const InstrumentSweep& sweep, const TipPose& tip, std::uint32_t face) {
  PaddedVector center = tip.center;
  const double reach = tip.radius_mm + skin_.tallest_mm(face);
  // About the middle of a capsule: its own half length is added to what it can reach.
  const PaddedVector middle = center + 0.5 * tip.axis;
  if (skin_.least_distance(face, middle) > reach + 0.5 * tip.axis.norm()) return;
  const SkinHit hit = deepest(tip, face, center);
  if (hit.distance_mm >= tip.radius_mm) return;
  const double free_share = response_of(hit.at).free_share;
  if (free_share == 0) return;
  const double before = (center - hit.point).dot(hit.normal);
  bool from_front = true;
  if (before < 0) {
    const bool square = -before > kSquareCosine * hit.distance_mm;
    const bool entered = sweep.just_placed || borders_front(face);
    if (entered && !square) return;  // round a corner of skin that is held already
    from_front = entered;
  }
  const Push push = push_of(hit, center, tip.radius_mm, from_front);
  if (push.clearance_mm < 0) touches_.push_back({hit, from_front, -push.clearance_mm, free_share});
}

void ContactSearch::admit(const InstrumentSweep& sweep, double fraction, const Touch& touch,
                          std::vector<Contact>& contacts) {
  std::size_t of_tip = 0;
  Contact* unloaded = nullptr;
  for (Contact& c : contacts) {
    if (c.instrument != sweep.instrument) continue;
    Pressed& pressed = std::get<Pressed>(c.kind);
    ++of_tip;
    const bool same = (c.point - touch.hit.point).norm() < kMergeWithin * sweep.to.radius_mm;
    if (same && pressed.from_front == touch.from_front) {
      // A contact slides with the deepest point and keeps its force; one a round is enough.
      if (!pressed.just_found)
        c.at = touch.hit.at, c.point = touch.hit.point, pressed.just_found = true;
      return;
    }
    if (c.force.isZero(0) && !pressed.just_found) unloaded = &c;
  }
  Contact made;
  made.kind = Pressed{touch.from_front, true};
  made.instrument = sweep.instrument;
  made.at = touch.hit.at;
  made.point = touch.hit.point;
  made.touched_at = fraction;
  if (of_tip < kMaxContactsPerTip) {
    contacts.push_back(made);
  } else if (unloaded) {
    *unloaded = made;
  }
}

}  // namespace organbake::deform
