// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "body/skin.h"
#include "contact/padded_vector.h"
#include "organbake/instruments/instrument.h"

namespace organbake::deform {

// A tip where it is at one moment (mm): a sphere about `center`, or a capsule along its axis.
struct TipPose {
  PaddedVector center = PaddedVector::Zero(), axis = PaddedVector::Zero();
  double radius_mm = 0;

  // Where along the axis (0…1) a point is nearest to it.
  double along(const PaddedVector& point) const {
    const double squared = axis.squaredNorm();
    if (squared == 0) return 0;
    return std::clamp((point - center).dot(axis) / squared, 0.0, 1.0);
  }
  // The sphere of the capsule that is nearest to a point, by its centre.
  PaddedVector center_near(const PaddedVector& point) const { return center + along(point) * axis; }
};

// A tip where it is at a share of its way through the step.
inline TipPose tip_at(const InstrumentSweep& sweep, double fraction) {
  return {padded(sweep.position_mm(fraction)), padded(sweep.axis_mm(fraction)), sweep.to.radius_mm};
}

// How a skin point answers to its face's three vertices. A face that is partly anchored gives way
// by its free share φ only: the constrained point is p0 + Σ (b_i/φ²) u_i instead of p0 + Σ b_i u_i,
// so pressing next to an anchor moves the free vertices by φ times the press. Held to the full
// press they would have to move 1/φ times as far, and skin beside the anchors would be flung about.
// Of a skin point that is held off another, both faces' vertices answer: the constrained point is
// the one relative to the other, whose weights are negative.
struct VertexResponse {
  int count = 3;  // 6 of two skin points
  std::array<std::uint32_t, 6> slots{};
  std::array<double, 6> weights{};  // b_i/φ², 0 for anchors
  double free_share = 0;            // φ; of two the larger, of a grip Φ
};

inline constexpr double kMinFreeShare = 0.05;  // what has a smaller one cannot give way

VertexResponse against(const VertexResponse& point, const VertexResponse& other);

// How a skin point that a grasper carries answers: to all vertices that carry it, as it is drawn.
// To the three of its face alone the points of a grip, which lie close together on a coarse face,
// would ask for corrections that are as many times too large as the face is larger than the grip,
// and each would call for a larger one.
//
// Beside anchors the points of one grip move as one: by the share Φ of the freest of them, the
// constrained point is p0 + Σ w_c u_c/(φ Φ), with φ = Σ w_c of what is free. Vertices that follow
// the grasper together, each by Φ times its way, then meet all of its points; held to its own
// share each point would ask them for another way.
struct CarrierResponse {
  std::vector<Carrier> carriers;  // those that are free, none by nothing
  double scale = 1;               // 1/(φ Φ)
  // Whether where it would lie with its carriers at rest is known, and no turning of a shell moves
  // it.
  bool fixed_at_rest = false;
  // A⁻¹ times a unit force on the constrained point (mm/mN), by moving slot: made when first asked
  // for.
  std::shared_ptr<const std::vector<double>> column = nullptr;
};

// What holds a skin point:

// An instrument holds it off: normal · (p − target) ≥ 0, with friction.
struct Pressed {
  bool from_front = true;   // the tip came from outside the body
  bool just_found = false;  // moved or made by this refresh
};

// A grasper carries it: p = target.
struct Carried {
  PaddedVector offset = PaddedVector::Zero();  // from the tip's centre, mm
  double closed = 0;                           // how far the jaws are, 0…1
  CarrierResponse response;
};

// A needle has gone through it: p lies on the line from the target along the normal, with friction.
struct OnNeedle {
  double most_friction_mn = 0;
};

// Other skin holds it off: p is then relative to that skin's point.
struct OnTissue {
  std::uint32_t probe = 0;  // which of its points
};

// A skin point that something holds. Its force persists from step to step as the next solve's first
// guess.
struct Contact {
  static constexpr std::uint32_t kNoInstrument = 0xFFFFFFFFu;

  std::variant<Pressed, Carried, OnNeedle, OnTissue> kind;
  std::uint32_t instrument = kNoInstrument;  // none of tissue
  SkinPoint at;
  double touched_at = 0;  // fraction of the step's sweep, for friction

  // Set by each refresh, for the shape and the tip's place of that moment.
  PaddedVector point = PaddedVector::Zero();  // mm
  VertexResponse response;
  // All that move the point, of a smooth skin over vertices that are wholly free: its force acts on
  // the response's slots alone. Empty: these move it, too.
  std::vector<Carrier> movers;
  PaddedVector normal = PaddedVector::Zero();  // unit, from the tip into the tissue; of a needle up
                                               // its shaft, of what is carried out of the skin
  PaddedVector target = PaddedVector::Zero();  // mm
  // Where the point would lie with its movers, its lever's slots or its grip's carriers at rest,
  // mm.
  PaddedVector anchored_at = PaddedVector::Zero();
  PaddedVector tip_motion = PaddedVector::Zero();  // of the tip since it touched, mm

  PaddedVector force = PaddedVector::Zero();  // on the tissue, mN
  // What the points that give way bear of it in all, mN: the instrument's, with its lever.
  PaddedVector felt_force() const { return 1 / response.free_share * force; }

  template <class Kind>
  Kind* as() {
    return std::get_if<Kind>(&kind);
  }
  template <class Kind>
  const Kind* as() const {
    return std::get_if<Kind>(&kind);
  }
  bool of_tissue() const { return as<OnTissue>() != nullptr; }
  // Whether it is there for as long as the instrument is, be it loaded or not.
  bool lasts() const { return as<Carried>() || as<OnNeedle>(); }
};

// How far a on_needle contact's point lies up the needle, mm.
inline double up_needle(const Contact& contact, const PaddedVector& point) {
  return (point - contact.target).dot(contact.normal);
}

// Shares the force on the tissue that an instrument's contact is told to have (mN) out to the
// points that answer to it, by slot.
void share_out_force(const Contact& contact, PaddedVectors& on_slots);

// The point that a contact's constraint acts on when the vertices lie at x (mm): away from anchors
// the skin point itself, its shell offset held.
PaddedVector constrained_point(const Contact& contact, const PaddedVectors& x,
                               const PaddedVectors& rest);

}  // namespace organbake::deform
