// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "body/skin.h"
#include "body/tissue.h"
#include "contact/contact.h"
#include "contact/contact_search.h"
#include "contact/padded_vector.h"
#include "organbake/deform/deformer.h"

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
// x, y and z, two contacts couple by one scalar w_ij = m_iᵀ A⁻¹ b_j (force j acts by b_j, point i
// moves by m_i, mostly b_i), and the small dense system is solved by projected Gauss–Seidel over
// 3-vectors (Coulomb's cone by projection) with the pressures among its unknowns, so that keeping
// the volume and holding off the tip cannot fight.
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
    // By the body's pressure, mm per unit: of where the force acts, and of the constrained point.
    PaddedVector volume_move, point_move;
  };
  struct Part {               // a vertex of a lever, a carrier or a mover; or a place of SkinGive
    std::uint32_t slot;       // or place
    std::uint32_t local = 0;  // into slots_, where the force acts
    double weight = 0, moves = 0;  // of the force, and of the point
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
    bool lopsided;   // its point is moved by other slots, or weights, than its force acts on
  };
  void complete_carriers(std::vector<Contact>& contacts);
  void gather(const PaddedVectors& x_start, const PaddedVectors& x_free,
              const std::vector<Contact>& contacts);
  PaddedVector aim_of(const Contact& contact, const PaddedVectors& x_start) const;
  static Part& part_of(std::uint32_t slot, std::uint32_t first, std::vector<Part>& parts);
  void add_parts(const Contact& contact, Unknown& u);
  void add_give(Unknown& u);
  void add_side(Unknown& u, std::uint32_t first, std::uint32_t end) const;
  void couple();
  void couple_give(std::size_t contact);
  bool mirrored(std::size_t i, std::size_t j) const {
    return j < i && !unknowns_[i].lopsided && !unknowns_[j].lopsided;
  }
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
  std::vector<Part> give_;             // of all contacts, by places
  PaddedVectors force_;                // one per contact, mN
  std::vector<std::uint32_t> slots_;   // of all levers, increasing
  std::vector<double> coupling_;       // w_ij, mm/mN, row-major
  PaddedVectors given_, relaxed_;      // by place, mm: now, and if nothing pressed in this step
  std::vector<double> give_by_place_;  // of one contact, mm/mN
};

// What a step left below skin that should hold it off, mm.
struct Penetration {
  double in_tips = 0, in_tissue = 0;
};

// The bodies' state and their time step: local and global iterations, each followed by the contacts
// and the volume, until skin lies on the instruments and on other skin.
class ShapeSolver {
 public:
  // The bodies are as bundles hold them, which are checked when they are read.
  ShapeSolver(const DeformBodies& bodies, const DeformOptions& options);

  const Tissue& tissue() const { return *tissue_; }
  const PaddedVectors& shape() const { return x_; }  // mm, by slot
  const std::vector<Contact>& contacts() const { return contacts_; }
  // Forces (N) on the proxy's vertices from now on; empty: none.
  void set_load(const std::vector<Eigen::Vector3d>& force_n);
  // Whether the tissue has no reason to leave its rest shape.
  bool relaxed_at_rest() const { return load_.empty() && tissue_->relaxed_at_rest(); }
  // Whether an instrument loads or carries the tissue, or tissue presses on tissue.
  bool held() const;

  // Whether nothing but tissue that presses on tissue keeps the shape.
  bool tangled() const;
  void untangle() { tissue_search_->untangle(contacts_); }

  // Lets tips that are just placed deep in tissue come in from outside, by the shortest way.
  void let_in(std::vector<InstrumentSweep>& sweeps);
  // Graspers that have closed since where no skin is to hold, or on such as anchors hold.
  std::size_t closed_in_vain() const { return closed_in_vain_; }
  // The skin that stops probes, in the shape of now.
  AnchoredSkin& anchored_skin() { return skin_.pose(x_), anchored_skin_; }
  // Whether a tip may come near the skin on its sweep. Has to precede the step.
  bool near_skin(const std::vector<InstrumentSweep>& sweeps) {
    find_faces(sweeps);
    return search_.found_any();
  }
  // Lets go of what instruments held that do not go on.
  void let_go(const std::vector<InstrumentSweep>& sweeps);
  // One time step. Graspers that are just placed close in it.
  Penetration step(const std::vector<InstrumentSweep>& sweeps);
  // Whether in the last step a tip moved so far that it may have left skin behind.
  bool tip_too_fast() const { return tip_too_fast_; }
  // How many graspers the tissue slipped from in the last step.
  std::size_t slipped() const { return slipped_; }
  // Where needles went through in the last step.
  const std::vector<Contact>& punctures() const { return punctures_; }
  // Takes the step's motion for the velocity and returns its largest (mm).
  double settle_motion();

  // Takes over how the bodies lie and move, and what instruments carry, from before they were cut.
  // sources: where each node of the tetrahedra lay in those of `before`.
  void continue_from(ShapeSolver& before, const std::vector<NodeSource>& sources,
                     const std::vector<Instrument>& instruments);

  // Lays points, by their slots, elsewhere, where they lie still; anchors stay. Nothing touches
  // anything then, until the next step finds what does.
  void place(const std::vector<std::uint32_t>& slots, const std::vector<Eigen::Vector3d>& at_mm);

  bool lost() const;  // not finite, or far beyond anything that tissue does
  double farthest_from_rest() const { return largest_distance(x_, tissue_->rest()); }
  void to_rest();
  // Names to a tape what outlasts a step; what came back from one is then taken up.
  template <class Self, class Tape>
  static void pass(Self& self, Tape& tape) {
    tape(self.x_, self.velocity_, self.load_, self.contacts_, self.last_energy_);
    BodyPressures::pass(self.pressures_, tape);
    ConstraintSolver::pass(self.constraints_, tape);
    ContactSearch::pass(self.search_, tape);
    if (self.tissue_search_) TissueContacts::pass(*self.tissue_search_, tape);
  }
  void be_restored() {
    if (tissue_search_) tissue_search_->be_restored();
    skin_.pose(x_);
  }
  // Time that the search for contacts took since this was last asked.
  double take_collision_ms() { return std::exchange(collision_ms_, 0.0); }

 private:
  Penetration move(const std::vector<InstrumentSweep>& sweeps);
  std::optional<std::uint32_t> lost_grasp() const;
  Penetration pull(const std::vector<InstrumentSweep>& sweeps);
  void advance(const std::vector<InstrumentSweep>& sweeps);
  void solve(const std::vector<InstrumentSweep>& sweeps, bool with_foresight);
  void move_freely(const PaddedVectors& from);
  const PaddedVectors& foreseen();
  void follow_sweeps(const std::vector<InstrumentSweep>& sweeps);
  bool tools_touch() const;
  void constrain(const std::vector<InstrumentSweep>& sweeps, double fraction);
  double energy() const;
  Penetration close_gaps(const std::vector<InstrumentSweep>& sweeps);
  void find_faces(const std::vector<InstrumentSweep>& sweeps);
  void find_adrift(const DeformBodies& bodies);
  void forget_touch();
  void slow_down();
  Penetration refresh(const std::vector<InstrumentSweep>& sweeps, double fraction);

  DeformOptions options_;
  double diagonal_mm_;
  std::unique_ptr<const Tissue> tissue_;
  // The slots of a piece that hangs on no anchor, and what a step leaves of their speed.
  struct Adrift {
    std::vector<std::uint32_t> slots;
    double kept = 1;
  };
  std::vector<Adrift> adrift_;
  GraspStrengths grasp_strength_n_;  // by organ
  BodyPressures pressures_;
  Skin skin_;
  ContactSearch search_;
  AnchoredSkin anchored_skin_;
  std::optional<TissueContacts> tissue_search_;
  ConstraintSolver constraints_;

  PaddedVectors x_, x_start_, x_free_, x_before_;  // mm, by slot
  PaddedVectors velocity_;                         // mm/s
  PaddedVectors x_coasted_;                        // where inertia alone would end the step
  PaddedVectors force_;  // left at a shape, mN; then the way from there, mm
  PaddedVectors load_;   // dead, on the free slots, mN; or empty
  std::vector<Contact> contacts_, punctures_;
  double moved_since_found_mm_ = 0;  // skin, since faces near the tips were sought
  bool tip_too_fast_ = false, touched_on_the_way_ = false, came_in_ = false;
  std::size_t slipped_ = 0, closed_in_vain_ = 0;
  double collision_ms_ = 0;
  double last_energy_ = std::numeric_limits<double>::infinity();  // while nothing touches
};

}  // namespace organbake::deform
