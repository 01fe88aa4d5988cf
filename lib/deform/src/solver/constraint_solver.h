// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "body/tissue.h"
#include "contact/contact.h"
#include "contact/padded_vector.h"

namespace organbake::deform {

// The volume under each closed part of the proxy, kept by a pressure: one scalar constraint
// V(x) + compliance · p = V(rest) per part. A part counts as closed when every edge is used as
// often one way as the other, which clustering proxies keep even where they are not manifold; open
// edges between anchors are allowed, because then V changes alike about any origin.
class EnclosedVolume {
 public:
  static constexpr std::uint32_t kNoBody = 0xFFFFFFFFu;
  struct Body {
    PaddedVector origin = PaddedVector::Zero();  // volumes are measured about it, mm
    double rest_mm3 = 0;
    // mm³ per mN/mm². With volume stiffness s the pressure is s/(1−s) times the bulk modulus of the
    // part's own springs times its volume strain: 1 keeps the volume, 0.5 doubles the resistance.
    double compliance = 0;
  };

  // volume_stiffness: 0 (free) … 1 (kept) of each organ of the tissue.
  EnclosedVolume(const Tissue& tissue, const std::vector<double>& volume_stiffness);

  const std::vector<Body>& bodies() const { return bodies_; }
  std::uint32_t body_of_slot(std::uint32_t slot) const { return body_of_slot_[slot]; }
  // mm³ of each body at x.
  void measure(const PaddedVectors& x, std::vector<double>& volumes_mm3) const;
  // ∂V/∂x of every vertex's own body, mm²; zero outside bodies and on anchors.
  void gradient(const PaddedVectors& x, PaddedVectors& gradient) const;

 private:
  std::vector<std::uint8_t> closed_parts(const Tissue& tissue) const;

  std::vector<Body> bodies_;
  std::vector<std::uint32_t> body_of_slot_;
  struct BodyFace {
    Face slots;
    std::uint32_t body;
  };
  std::vector<BodyFace> faces_;
  std::size_t free_count_ = 0;
};

// The pressures p that keep the volumes of bodies: each pushes its body's skin along ∇V, which
// moves it by A⁻¹∇V p. Softly: V + compliance · p = V(rest).
class BodyPressures {
 public:
  BodyPressures(const Tissue& tissue, EnclosedVolume volume);

  bool none() const { return pressure_.empty(); }
  template <class Self, class Tape>
  static void pass(Self& self, Tape& tape) {
    tape(self.pressure_);
  }
  std::uint32_t count() const { return static_cast<std::uint32_t>(pressure_.size()); }
  void reset();
  // Takes ∇V at the shape a step starts from.
  void begin_step(const PaddedVectors& x_start);
  // Replaces three right sides by A⁻¹ times them. The step's first one solves A⁻¹∇V, too, in little
  // more time.
  void solve_along(PaddedVector* rows);

  std::uint32_t body_of_slot(std::uint32_t slot) const { return volume_.body_of_slot(slot); }
  // Of a slot of a body, mm per unit of the body's pressure.
  const PaddedVector& move_of(std::uint32_t slot) const { return response_[slot]; }
  double pressure(std::uint32_t body) const { return pressure_[body]; }  // mN/mm²
  // A pressure that moves nothing (flat or anchored skin) is left alone.
  bool acts(std::uint32_t body) const;

  // The volumes V(rest) − V(x_free), linearised about x.
  void measure_gaps(const PaddedVectors& x_free, const PaddedVectors& x);
  // What is left of it under the pressure, mm³, without any contact; and the change of the pressure
  // that closes what contacts leave.
  double gap(std::uint32_t body) const {
    return volume_gap_[body] - softness_[body] * pressure_[body];
  }
  double close(std::uint32_t body, double gap_mm3);

  // x_free, moved by the pressures (mm).
  void move(const PaddedVectors& x_free, PaddedVectors& x) const;
  // Largest |V + compliance · p − V(rest)| / V(rest) over the bodies.
  double volume_error(const PaddedVectors& x);
  // What soft pressures hold (µJ): ½ compliance p².
  double energy() const;

 private:
  void measure_softness();

  const Tissue& tissue_;
  EnclosedVolume volume_;
  PaddedVectors gradient_, response_;  // ∇V (mm²) and A⁻¹∇V
  bool response_due_ = false;          // response_ holds ∇V still
  std::vector<double> pressure_;       // one per body
  std::vector<double> softness_;  // ∇Vᵀ A⁻¹ ∇V + compliance, mm³ per unit of pressure
  std::vector<double> most_pressure_;  // that the linearised volume can be asked about
  std::vector<double> volume_gap_;
  std::vector<double> volumes_;
};

// Columns of A⁻¹ (mm per mN) for the points that contacts touch, carried ones among them: made when
// first asked for and kept over the steps, because A never changes.
class ComplianceColumns {
 public:
  explicit ComplianceColumns(const Tissue& tissue);

  // Makes the columns of `slots` (all moving) that are missing, four at a time. May drop others.
  void require(const std::vector<std::uint32_t>& slots);
  // Makes the columns of up to four carrier responses.
  void make(std::span<CarrierResponse* const> responses);
  // moving_count values; valid until the next require().
  const double* column(std::uint32_t slot) const { return columns_[place_of_slot_[slot]].data(); }

 private:
  void make(const std::uint32_t* slots, std::size_t count);
  void put(std::uint32_t slot, double weight, std::size_t lane);
  void solve();
  void read(std::size_t lane, std::vector<double>& column) const;

  const Tissue& tissue_;
  std::size_t capacity_;
  std::vector<std::uint32_t> place_of_slot_;
  std::vector<std::vector<double>> columns_;
  PaddedVectors scratch_;
};

// Finds the contact forces f and the pressures p that bring the unconstrained shape onto its
// constraints through the factor that exists: x = x_free + A⁻¹(Jᵀf + ∇V p). Because A acts alike on
// x, y and z, two contacts couple by one scalar w_ij = b_iᵀ A⁻¹ b_j, and the small dense system is
// solved by projected Gauss–Seidel over 3-vectors (Coulomb's cone by projection) with the pressures
// among its unknowns, so that keeping the volume and holding off the tip cannot fight.
class ConstraintSolver {
 public:
  ConstraintSolver(const Tissue& tissue, BodyPressures& pressures, double friction);

  // A step begins: the skin that instruments held before has begun to come back.
  void relax_give() { tissue_.give().relax(relaxed_ = given_); }
  // The pressures' begin_step() and solve_along() come before a step's first one.
  // x: in, the shape that the contacts were refreshed at; out, the constrained shape (mm).
  void solve(const PaddedVectors& x_start, const PaddedVectors& x_free,
             std::vector<Contact>& contacts, PaddedVectors& x);
  template <class Self, class Tape>
  static void pass(Self& self, Tape& tape) {
    tape(self.given_);
  }
  // How far the skin has given way (SkinGive): not at all, or as before another cut.
  void forget_give() { given_ = tissue_.give().none(); }
  void take_give(const ConstraintSolver& before, PaddedVectors& x) {
    tissue_.give().move_points(given_ = before.given_, x);
  }

 private:
  struct Side {  // the vertices of one face
    std::uint32_t body;
    PaddedVector volume_move;  // of the constrained point, mm per unit of the body's pressure
  };
  struct Part {  // a vertex of a lever, or a carrier of a grip
    std::uint32_t slot;
    std::uint32_t local;  // into slots_, when it moves
    double weight;
  };
  struct Unknown {                       // one contact in the dense system
    std::uint32_t first, end;            // of its parts
    std::uint32_t first_give, end_give;  // of its shares in the skin's places
    const double* column;                // of a grip, or none
    PaddedVector free_point;             // mm, without any force
    PaddedVector aim;  // where it would come to lie if all forces were allowed, mm
    Side sides[2];
    int side_count;  // of those whose body has a pressure
    double own;      // w_ii, mm/mN: how far a force moves its own point
    double per_own;  // its reciprocal; 0 for a point that nothing moves
    double kept;     // of a force: the rest is give
  };
  void complete_carriers(std::vector<Contact>& contacts);
  void gather(const PaddedVectors& x_start, const PaddedVectors& x_free,
              const std::vector<Contact>& contacts);
  PaddedVector aim_of(const Contact& contact, const PaddedVectors& x_start) const;
  void add_parts(const Contact& contact, Unknown& u);
  void add_give(Unknown& u);
  void add_side(Unknown& u, std::uint32_t first, std::uint32_t end) const;
  void couple();
  void couple_give(std::size_t contact);
  void add_coupling(std::size_t contact, double force, const double* column);
  void iterate(std::vector<Contact>& contacts);
  double sweep_contacts(const std::vector<Contact>& contacts);
  double sweep_pressures();
  void give_way(PaddedVectors& x);
  void apply(const PaddedVectors& x_free, PaddedVectors& x) const;

  const Tissue& tissue_;
  BodyPressures& pressures_;
  double friction_;
  ComplianceColumns columns_;
  std::vector<Unknown> unknowns_;
  std::vector<Part> parts_;            // of all contacts
  std::vector<Carrier> give_;          // of all contacts, by places
  PaddedVectors force_;                // one per contact, mN
  std::vector<std::uint32_t> slots_;   // of all levers, increasing
  std::vector<double> coupling_;       // w_ij, mm/mN, row-major
  PaddedVectors given_, relaxed_;      // by place, mm: now, and if nothing pressed in this step
  std::vector<double> give_by_place_;  // of one contact, mm/mN
};

}  // namespace organbake::deform
