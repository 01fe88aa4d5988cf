// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "body/skin.h"
#include "contact/rows.h"

namespace organbake::deform {

// A tip where it is at one moment (mm): a sphere about `center`, or a capsule along its axis.
struct TipPose {
  Row center = Row::Zero(), axis = Row::Zero();
  double radius_mm = 0;

  // Where along the axis (0…1) a point is nearest to it.
  double along(const Row& point) const {
    const double squared = axis.squaredNorm();
    if (squared == 0) return 0;
    return std::clamp((point - center).dot(axis) / squared, 0.0, 1.0);
  }
  // The sphere of the capsule that is nearest to a point, by its centre.
  Row center_near(const Row& point) const { return center + along(point) * axis; }
};

// One tip's way through the current step (mm).
struct TipSweep {
  std::uint32_t tip = 0;
  Row from = Row::Zero(), to = Row::Zero();
  Row axis_from = Row::Zero(), axis_to = Row::Zero();
  double radius_mm = 0;
  // No earlier position is known: skin that the tip overlaps counts as entered from outside.
  bool just_placed = false;
  bool grabs = false;
  bool pierces = false;  // a needle

  TipPose at(double fraction) const {
    return {from + fraction * (to - from), axis_from + fraction * (axis_to - axis_from), radius_mm};
  }
  // The step's motion of the place `along` the axis.
  Row motion(double along) const { return (to - from) + along * (axis_to - axis_from); }
};

// How a skin point answers to its face's three vertices. A face that is partly anchored gives way
// by its free share φ only: the constrained point is p0 + Σ (b_i/φ²) u_i instead of p0 + Σ b_i u_i,
// so pressing next to an anchor moves the free vertices by φ times the press. Held to the full
// press they would have to move 1/φ times as far, and skin beside the anchors would be flung about.
// Of a skin point that is held off another, both faces' vertices answer: the constrained point is
// the one relative to the other, whose weights are negative.
struct Lever {
  int count = 3;  // 6 of two skin points
  std::array<std::uint32_t, 6> slots{};
  std::array<double, 6> weights{};  // b_i/φ², 0 for anchors
  double free_share = 0;            // φ; of two the larger, of a grip Φ
};

inline constexpr double kMinFreeShare = 0.05;  // what has a smaller one cannot give way

Lever against(const Lever& point, const Lever& other);

// How a skin point that a grasper carries answers: to all vertices that carry it, as it is drawn.
// To the three of its face alone the points of a grip, which lie close together on a coarse face,
// would ask for corrections that are as many times too large as the face is larger than the grip,
// and each would call for a larger one.
//
// Beside anchors the points of one grip move as one: by the share Φ of the freest of them, the
// constrained point is p0 + Σ w_c u_c/(φ Φ), with φ = Σ w_c of what is free. Vertices that follow
// the grasper together, each by Φ times its way, then meet all of its points; held to its own
// share each point would ask them for another way.
struct Grip {
  std::vector<Carrier> carriers;  // those that are free, none by nothing
  double scale = 1;               // 1/(φ Φ)
  // Whether where it would lie with its carriers at rest is known, and no turning of a shell moves
  // it.
  bool fixed_at_rest = false;
  // A⁻¹ times a unit force on the constrained point (mm/mN), by moving slot: made when first asked
  // for.
  std::shared_ptr<const std::vector<double>> column = nullptr;
};

// A skin point that an instrument holds off (normal · (p − target) ≥ 0, with friction) or carries
// (p = target), that a needle has gone through (p on the line from the target along the normal,
// with friction), or that other skin holds off: p is then relative to that skin's point. Its force
// persists from step to step as the next solve's first guess.
struct Contact {
  static constexpr std::uint32_t kTissue = 0xFFFFFFFFu;
  bool of_tissue() const { return tip == kTissue; }

  std::uint32_t tip = 0;     // kTissue: other skin
  std::uint32_t feeler = 0;  // of tissue: which of its points
  SkinPoint at;
  bool carried = false;
  bool threaded = false;          // on a needle
  bool from_front = true;         // the tip came from outside the body
  double touched_at = 0;          // fraction of the step's sweep, for friction
  Row grab_offset = Row::Zero();  // carried: from the tip's centre, mm
  Grip grip;                      // carried

  // Set by each refresh, for the shape and the tip's place of that moment.
  Row point = Row::Zero();  // mm
  Lever lever;
  Row normal = Row::Zero();  // unit, from the tip into the tissue; of a needle up its shaft
  Row target = Row::Zero();  // mm
  // Where the point would lie with its lever's slots, or its grip's carriers, at rest, mm.
  Row anchored_at = Row::Zero();
  Row tip_motion = Row::Zero();  // of the tip since it touched, mm
  double grip_mn = 0;            // threaded: friction's most
  bool fresh = false;            // moved or made by this refresh

  Row force = Row::Zero();  // on the tissue, mN
};

// How far a threaded contact's point lies up the needle, mm.
inline double up_needle(const Contact& contact, const Row& point) {
  return (point - contact.target).dot(contact.normal);
}

// The point that a contact's constraint acts on when the vertices lie at x (mm): away from anchors
// the skin point itself, its shell offset held.
Row constrained_point(const Contact& contact, const Rows& x, const Rows& rest);

}  // namespace organbake::deform
