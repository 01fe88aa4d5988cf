// SPDX-License-Identifier: Apache-2.0
// A contact's constrained point and the force that it hands on to the vertices that carry it, for
// all kinds of contacts. Tissue's hold skin off skin: a point that has sunk below skin in front of
// which it was before becomes a contact. Where points are and what they feel is found in
// tissue_probes.cpp.
#include "contact/contact.h"

#include <utility>

#include "contact/contact_search.h"

namespace organbake::deform {

VertexResponse against(const VertexResponse& point, const VertexResponse& other) {
  VertexResponse both = point;
  both.count = 6;
  for (int k = 0; k < 3; ++k) {
    both.slots[3 + k] = other.slots[k];
    both.weights[3 + k] = -other.weights[k];
  }
  both.free_share = std::max(point.free_share, other.free_share);
  return both;
}

void share_out_force(const Contact& contact, PaddedVectors& on_slots) {
  std::vector<Carrier> answer;
  if (const Carried* carried = contact.as<Carried>()) {
    answer = carried->response.carriers;
  } else {
    for (int k = 0; k < 3; ++k)
      answer.push_back({contact.response.slots[k], contact.response.weights[k]});
  }
  double sum = 0;
  for (const Carrier& carrier : answer) sum += carrier.weight;
  for (const Carrier& carrier : answer)
    on_slots[carrier.slot] += carrier.weight / sum * contact.felt_force();
}

PaddedVector constrained_point(const Contact& contact, const PaddedVectors& x,
                               const PaddedVectors& rest) {
  PaddedVector point = contact.anchored_at;
  if (const Carried* carried = contact.as<Carried>()) {
    for (const auto& [slot, weight] : carried->response.carriers)
      point += carried->response.scale * weight * (x[slot] - rest[slot]);
    return point;
  }
  for (const auto& [slot, weight] : contact.movers) point += weight * (x[slot] - rest[slot]);
  for (int k = 0; k < contact.response.count && contact.movers.empty(); ++k) {
    const std::uint32_t slot = contact.response.slots[k];
    point += contact.response.weights[k] * (x[slot] - rest[slot]);
  }
  return point;
}

void TissueContacts::reset() {
  in_front_ = in_front_at_rest_;
  released_.assign(probes_.size(), 0);
  x_of_pairs_.clear();
  x_probed_.clear();
}

void TissueContacts::go_back_to(const Sides& sides) {
  in_front_ = sides.in_front;
  released_ = sides.released;
  x_probed_.clear();
}

void TissueContacts::untangle(std::vector<Contact>& contacts) {
  for (const Contact& c : contacts) {
    if (const OnTissue* other = c.as<OnTissue>()) released_[other->probe] = 1;
  }
  std::erase_if(contacts, [](const Contact& c) { return c.of_tissue(); });
  x_probed_.clear();
}

bool TissueContacts::between_pieces(std::uint32_t face, std::uint32_t other) const {
  const std::uint32_t p = tissue_.piece_of_face(face), q = tissue_.piece_of_face(other);
  return p != q && (tissue_.pieces()[p].cut || tissue_.pieces()[q].cut);
}

bool TissueContacts::parts_pieces(const Contact& contact) const {
  const OnTissue* other = contact.as<OnTissue>();
  return other && between_pieces(probes_[other->probe].face, probed_[other->probe].other.at.face);
}

// Whether a probe is inside the piece whose skin it lies below. One that was found outside is not
// asked again in the same step.
bool TissueContacts::is_inside(std::uint32_t probe) {
  if (outside_in_step_[probe] == step_) return false;
  const std::uint32_t other = probed_[probe].other.at.face;
  const std::uint32_t piece = tissue_.piece_of_face(other);
  const bool inside = skin_.encloses(own_[probe].point, piece_faces_[piece]);
  if (!inside) outside_in_step_[probe] = step_;
  return inside;
}

// How far below the other skin a probe still counts as in front of it.
double TissueContacts::touching_mm(std::uint32_t probe) const {
  const bool walls =
      skin_.at_cut(probes_[probe].face) || skin_.at_cut(probed_[probe].other.at.face);
  constexpr double kWallSlack_mm = 0.1;  // that the walls of a cut may sink into each other
  return walls ? kWallSlack_mm : 0;
}

// How much deeper a probe is than it may be.
double TissueContacts::sunk_mm(std::uint32_t probe) const {
  return in_front_[probe] ? probed_[probe].depth_mm - allowed_mm(probe) : 0;
}

double TissueContacts::allowed_mm(std::uint32_t probe) const {
  return std::max({overlap_mm_[piece_pair(probes_[probe].face, probed_[probe].other.at.face)],
                   rest_depth_mm_[probe], touching_mm(probe)});
}

// How far the nearest of the points that could sink still has to go.
double TissueContacts::clearance_mm() const {
  double least = margin_mm_;
  for (const std::uint32_t k : touched_) {
    if (in_front_[k]) least = std::min(least, -sunk_mm(k));
  }
  return least;
}

double TissueContacts::refresh(std::vector<Contact>& contacts) {
  // Skin moves farther than the proxy's vertices where its normals turn.
  constexpr double kSafe = 0.25;
  const bool all =
      x_probed_.empty() || !(largest_distance(skin_.shape(), x_probed_) <= kSafe * clearance_mm_);
  if (!all && watched_.empty()) return 0;
  all ? probe_all() : probe_watched();
  std::erase_if(contacts, [&](const Contact& c) {
    const OnTissue* other = c.as<OnTissue>();
    return other && !probed_[other->probe].found;
  });
  double deepest = 0;
  std::size_t count = 0;
  for (Contact& c : contacts) {
    const OnTissue* other = c.as<OnTissue>();
    if (!other) continue;
    ++count;
    update(c);
    probed_[other->probe].has_contact = true;
    deepest = std::max(deepest, sunk_mm(other->probe));
  }
  std::vector<std::uint32_t> sunk;
  for (const std::uint32_t k : all ? touched_ : watched_) {
    if (probed_[k].found && !probed_[k].has_contact && sunk_mm(k) > 0) sunk.push_back(k);
  }
  std::stable_sort(sunk.begin(), sunk.end(),
                   [&](std::uint32_t p, std::uint32_t q) { return sunk_mm(p) > sunk_mm(q); });
  for (const std::uint32_t k : sunk) {
    Contact made;
    made.kind = OnTissue{k};
    made.at = probes_[k];
    update(made);
    if (made.response.free_share == 0) continue;  // neither side can give way
    if (is_crowded(made, contacts)) continue;
    deepest = std::max(deepest, sunk_mm(k));
    if (count++ < kMost) contacts.push_back(made);
  }
  if (all) watch_nearest(contacts, count);
  return deepest;
}

// Where nothing touches, none: all keep the clearance of the nearest. Else the contacts' and some
// more, so that the others have some way to go: a step ends with many rounds that move little.
void TissueContacts::watch_nearest(const std::vector<Contact>& contacts, std::size_t count) {
  constexpr std::size_t kMorePerContact = 4;
  x_probed_.clear();
  watched_.clear();
  clearance_mm_ = clearance_mm();
  if (count > 0) {
    clearance_mm_ = margin_mm_;
    std::vector<std::pair<double, std::uint32_t>> left_mm;
    for (const std::uint32_t k : touched_)
      if (in_front_[k]) left_mm.emplace_back(-sunk_mm(k), k);
    for (const Contact& c : contacts)
      if (const OnTissue* other = c.as<OnTissue>()) watched_.push_back(other->probe);
    const std::size_t more = kMorePerContact * count;
    if (more < left_mm.size()) {
      const auto next = left_mm.begin() + static_cast<std::ptrdiff_t>(more);
      std::nth_element(left_mm.begin(), next, left_mm.end());
      clearance_mm_ = std::min(margin_mm_, next->first);
    }
    for (const auto& [mm, k] : left_mm)
      if (mm < clearance_mm_) watched_.push_back(k);
    std::sort(watched_.begin(), watched_.end());
    watched_.erase(std::unique(watched_.begin(), watched_.end()), watched_.end());
  }
  if (clearance_mm_ <= 0) return;
  x_probed_ = skin_.shape();
  list_near_watched();
}

// Skin beside cuts is made of small faces, each with a point that feels, of which a few hold all.
bool TissueContacts::is_crowded(const Contact& made, const std::vector<Contact>& contacts) const {
  const auto at_cut = [this](const Contact& c) {
    const std::uint32_t probe = std::get<OnTissue>(c.kind).probe;
    return parts_pieces(c) || touching_mm(probe) > 0;
  };
  if (!at_cut(made)) return false;
  return std::any_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
    return c.of_tissue() && at_cut(c) && (c.point - made.point).norm() < crowd_mm_;
  });
}

// The constrained point is the probe relative to the skin below which it must not sink.
void TissueContacts::update(Contact& contact) const {
  const std::uint32_t probe = std::get<OnTissue>(contact.kind).probe;
  const SkinPoint& at = probes_[probe];
  const Probed& probed = probed_[probe];
  contact.point = own_[probe].point;
  contact.normal = probed.other.normal;
  contact.target = -allowed_mm(probe) * probed.other.normal;
  contact.tip_motion.setZero();
  contact.response = against(search_.response_of(at), search_.response_of(probed.other.at));
  contact.anchored_at = search_.anchored(at, own_[probe].point) -
                        search_.anchored(probed.other.at, probed.other.point);
}

}  // namespace organbake::deform
