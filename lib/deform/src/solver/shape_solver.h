// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "body/skin.h"
#include "body/tissue.h"
#include "contact/contact_search.h"
#include "contact/tissue_contacts.h"
#include "contact/tool_contacts.h"
#include "organbake/deform/deformer.h"
#include "solver/constraint_solver.h"

namespace organbake::deform {

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
