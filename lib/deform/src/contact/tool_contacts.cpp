// SPDX-License-Identifier: Apache-2.0
// Tools are capsules and much stiffer than tissue: overlaps are taken back pair by pair in rounds,
// as in position-based dynamics (Müller et al. 2007), half by each. The step's way is followed in
// pieces that bring no centre past another's, or fast tools would pass through each other. Skin
// that is anchored stops probes in the same way, all of the overlap taken back by the probe.
#include "contact/contact_search.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace organbake::deform {

using Eigen::Vector3d;

AnchoredSkin::AnchoredSkin(Skin& skin, ContactSearch& search) : skin_(skin), search_(search) {
  const Tissue& tissue = search.tissue();
  constexpr double kSlack_mm = 2;  // that skin beside free tissue moves by
  for (std::uint32_t f = 0; f < skin.faces().size(); ++f) {
    const auto& [a, b, c] = skin.faces()[f];
    if (std::min({tissue.free_share(a), tissue.free_share(b), tissue.free_share(c)}) >=
        kMinFreeShare)
      continue;
    Bounds corners;
    for (const std::uint32_t slot : {a, b, c}) corners.add(tissue.rest()[slot].head<3>());
    faces_.push_back(
        {f, corners.center(), corners.diagonal() / 2 + skin.tallest_mm(f) + kSlack_mm});
  }
}

int AnchoredSkin::pieces_between(const Instrument& from, const Instrument& to) const {
  if (!to.active || !to.is<Ball>()) return 0;
  constexpr double kPieceOfRadius = 0.5;
  constexpr int kMost = 1024;
  const Vector3d way = to.position_mm - from.position_mm;
  const double reach_mm = to.radius_mm + std::max(from.axis_mm.norm(), to.axis_mm.norm());
  const auto near = [&](const Face& face) {
    const Vector3d off = face.center_mm - from.position_mm;
    const double along = way.isZero(0) ? 0 : std::clamp(off.dot(way) / way.squaredNorm(), 0.0, 1.0);
    return (off - along * way).norm() < face.radius_mm + reach_mm;
  };
  if (std::none_of(faces_.begin(), faces_.end(), near)) return 0;
  return static_cast<int>(
      std::min<double>(kMost, 1 + way.norm() / (kPieceOfRadius * to.radius_mm)));
}

std::optional<AnchoredSkin::Overlap> AnchoredSkin::deepest(std::uint32_t number, bool just_placed,
                                                           const Instrument& tip) {
  constexpr double kTouching_mm = 1e-6, kSquareCosine = 0.5;
  const TipPose pose{padded(tip.position_mm), padded(tip.axis_mm), tip.radius_mm};
  std::optional<Overlap> deepest;
  for (const Face& face : faces_) {
    const double reach_mm = face.radius_mm + tip.radius_mm + tip.axis_mm.norm();
    if ((face.center_mm - tip.position_mm).norm() > reach_mm) continue;
    PaddedVector center;
    const SkinHit hit = search_.deepest(pose, face.face, center);
    if (hit.distance_mm > tip.radius_mm - kTouching_mm ||
        search_.response_of(hit.at).free_share > 0)
      continue;
    // A probe whose middle is behind the skin came from there, or round a corner of it.
    const double before_mm = (center - hit.point).dot(hit.normal);
    const bool behind = before_mm < 0;
    if (behind && !just_placed && -before_mm < kSquareCosine * hit.distance_mm) continue;
    const bool turned = (behind && just_placed) || hit.distance_mm == 0;
    const PaddedVector outward =
        turned ? hit.normal : PaddedVector((center - hit.point) / hit.distance_mm);
    const double depth_mm = tip.radius_mm - (turned ? before_mm : hit.distance_mm);
    if (!deepest || depth_mm > deepest->depth_mm)
      deepest = {{number, hit, outward.head<3>()}, depth_mm};
  }
  return deepest;
}

void AnchoredSkin::push_off(std::uint32_t number, bool just_placed, Instrument& tip) {
  constexpr int kMostPushes = 8;  // in a corner of the wall
  if (!tip.active || !tip.is<Ball>()) return;
  std::erase_if(touches_, [number](const Touch& touch) { return touch.instrument == number; });
  for (int push = 0; push < kMostPushes; ++push) {
    const std::optional<Overlap> overlap = deepest(number, just_placed, tip);
    if (!overlap) return;
    tip.position_mm += overlap->depth_mm * overlap->touch.outward;
    if (push == 0) touches_.push_back(overlap->touch);
  }
}

namespace {

constexpr int kRounds = 32;
constexpr double kTouching = 1e-9;  // of both radii
// Of both radii: a piece this long brings no centre past the other's.
constexpr double kPieceOfRadii = 0.5;
constexpr int kMostContactPieces = 256;
// Pairs looked at in a step, by all rounds of all pieces: so many tips that not even one piece
// keeps to it are followed in one.
constexpr double kMostPairs = 2e6;
constexpr double kTouchWithin = 1e-6;  // of both radii: pushed apart, tools touch by rounding

double share_of(double part, double whole) {
  return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0;
}

// From the one's axis to the other's, the shortest way.
Vector3d way_between(const Instrument& a, const Instrument& b) {
  const auto [s, t] = nearest_on_segments(a.position_mm, a.axis_mm, b.position_mm, b.axis_mm);
  return (b.position_mm + t * b.axis_mm) - (a.position_mm + s * a.axis_mm);
}

// Moves two tips apart until they touch; false when they lie apart already.
bool part(Instrument& a, Instrument& b) {
  const Vector3d way = way_between(a, b);
  const double distance = way.norm(), together = a.radius_mm + b.radius_mm;
  const double overlap = together - distance;
  if (!(overlap > kTouching * together)) return false;
  // Axes that cross tell no way out; any across both will do.
  Vector3d out = way;
  if (!(distance > kTouching * together)) {
    out = a.axis_mm.cross(b.axis_mm);
    if (out.isZero(0)) out = a.axis_mm.isZero(0) ? Vector3d::UnitX() : a.axis_mm.unitOrthogonal();
  }
  out.normalize();
  a.position_mm -= overlap / 2 * out;
  b.position_mm += overlap / 2 * out;
  return true;
}

double gap_mm(const Instrument& a, const Instrument& b) {
  return way_between(a, b).norm() - (a.radius_mm + b.radius_mm);
}

// How far at most a point of the tip moves, mm.
double way_mm(const Instrument& from, const Instrument& to) {
  const Vector3d at_base = to.position_mm - from.position_mm;
  return std::max(at_base.norm(), (at_base + to.axis_mm - from.axis_mm).norm());
}

// Blades and needles are thin, and pass beside other tools.
bool both_there(const Instrument& a, const Instrument& b) {
  return a.active && b.active && a.is_blunt() && b.is_blunt();
}

// In how many pieces tips have to be moved so that none passes another; 0: they don't meet.
int pieces_between(const std::vector<Instrument>& from, const std::vector<Instrument>& to) {
  double most = 0;
  for (std::size_t i = 0; i < to.size(); ++i) {
    for (std::size_t j = i + 1; j < to.size(); ++j) {
      if (!both_there(to[i], to[j])) continue;
      const double way = way_mm(from[i], to[i]) + way_mm(from[j], to[j]);
      if (gap_mm(from[i], from[j]) > way) continue;
      const double piece = kPieceOfRadii * (to[i].radius_mm + to[j].radius_mm);
      most = std::max(most, 1 + way / piece);
    }
  }
  const auto tips = static_cast<double>(to.size());
  const double affordable = std::max(1.0, kMostPairs / (kRounds * tips * tips / 2));
  return static_cast<int>(std::min({most, affordable, double(kMostContactPieces)}));
}

}  // namespace

// Ericson, Real-Time Collision Detection (2005), 5.1.9.
NearestOnSegments nearest_on_segments(const Vector3d& first_at, const Vector3d& first_way,
                                      const Vector3d& second_at, const Vector3d& second_way) {
  const Vector3d between = first_at - second_at;
  const double a = first_way.squaredNorm(), b = first_way.dot(second_way),
               e = second_way.squaredNorm(), c = first_way.dot(between),
               f = second_way.dot(between);
  double s = share_of(b * f - c * e, a * e - b * b);
  double t = share_of(b * s + f, e);
  s = share_of(b * t - c, a);
  return {s, t};
}

std::vector<Instrument> held_apart(std::vector<Instrument> tips) {
  for (int round = 0; round < kRounds; ++round) {
    bool any = false;
    for (std::size_t i = 0; i < tips.size(); ++i) {
      for (std::size_t j = i + 1; j < tips.size(); ++j) {
        if (both_there(tips[i], tips[j]) && part(tips[i], tips[j])) any = true;
      }
    }
    if (!any) break;
  }
  return tips;
}

std::vector<Instrument> moved_apart(const std::vector<Instrument>& held,
                                    const std::vector<Instrument>& asked, AnchoredSkin* anchored) {
  std::vector<Instrument> from = asked;
  const auto goes_on = [&](std::size_t i) {
    return i < held.size() && both_there(held[i], asked[i]);
  };
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (!goes_on(i)) continue;
    from[i].position_mm = held[i].position_mm;
    from[i].axis_mm = held[i].axis_mm;
  }
  int pieces = pieces_between(from, asked);
  if (anchored) anchored->begin_step();
  for (std::size_t i = 0; anchored && i < asked.size(); ++i)
    pieces = std::max(pieces, anchored->pieces_between(from[i], asked[i]));
  if (pieces == 0) return asked;
  std::vector<Instrument> tips = from;
  std::vector<Vector3d> pushed(asked.size(), Vector3d::Zero());
  for (int piece = 1; piece <= pieces; ++piece) {
    const double share = double(piece) / pieces;
    for (std::size_t i = 0; i < tips.size(); ++i) {
      const Vector3d way = asked[i].position_mm - from[i].position_mm;
      tips[i].position_mm = from[i].position_mm + share * way + pushed[i];
      tips[i].axis_mm = from[i].axis_mm + share * (asked[i].axis_mm - from[i].axis_mm);
    }
    std::vector<Instrument> apart = held_apart(tips);
    for (std::size_t i = 0; anchored && i < tips.size(); ++i)
      anchored->push_off(static_cast<std::uint32_t>(i), !goes_on(i), apart[i]);
    for (std::size_t i = 0; i < tips.size(); ++i)
      pushed[i] += apart[i].position_mm - tips[i].position_mm;
    tips = apart;
  }
  for (std::size_t i = 0; i < tips.size(); ++i)
    if (pushed[i].isZero(0)) tips[i] = asked[i];
  return tips;
}

std::size_t count_touching(const std::vector<Instrument>& tips) {
  std::size_t touching = 0;
  for (std::size_t i = 0; i < tips.size(); ++i) {
    for (std::size_t j = i + 1; j < tips.size(); ++j) {
      const double radii = tips[i].radius_mm + tips[j].radius_mm;
      touching += both_there(tips[i], tips[j]) && gap_mm(tips[i], tips[j]) < kTouchWithin * radii;
    }
  }
  return touching;
}

}  // namespace organbake::deform
