// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "body/skin.h"
#include "body/tissue.h"
#include "contact/contact.h"

namespace organbake::deform {

// Finds where the tips press into the skin. Per touched face it is the deepest point; sets of
// points build up over the rounds of a step (cutting planes), so that a few rounds hold off the
// whole patch under a tip.
class ContactSearch {
 public:
  static constexpr std::size_t kMaxContactsPerTip = 24;

  ContactSearch(Skin& skin, const Tissue& tissue);

  // Broad phase: the faces whose shell may come within a tip's reach on its sweep, x in mm.
  void find_faces(const PaddedVectors& x, const std::vector<InstrumentSweep>& sweeps);
  // How far the skin may move till the faces have to be sought anew.
  static double slack_mm(const std::vector<InstrumentSweep>& sweeps);
  bool found_any() const;
  // How far a tip lies deeper in tissue than any skin can meet it, and the shortest way on which it
  // leaves: of a needle along its axis, backwards. Zero of one that touches skin, or is outside.
  Eigen::Vector3d way_out(const Instrument& tip) const;
  const std::vector<std::uint32_t>& faces_near(std::size_t sweep) const { return near_[sweep]; }

  // Brings every contact's geometry up to date with the skin's pose and the tips at `fraction` of
  // their sweeps, and adds the points that are inside a tip. Returns the deepest penetration (mm)
  // of skin that is free to give way.
  double refresh(const std::vector<InstrumentSweep>& sweeps, double fraction,
                 std::vector<Contact>& contacts);
  // Where a skin point that lies at `point` would lie with its face's vertices at rest.
  PaddedVector anchored(const SkinPoint& at, const PaddedVector& point) const;
  // The lever of a skin point; its free share is 0 where nothing can give way.
  VertexResponse response_of(const SkinPoint& at) const;
  const Tissue& tissue() const { return tissue_; }
  template <class Self, class Tape>
  static void pass(Self& self, Tape& tape) {
    tape(self.boxes_, self.x_of_boxes_, self.slack_left_mm_);
  }
  // The face's skin point that is nearest to a tip, and the centre of the tip's sphere there.
  SkinHit deepest(const TipPose& tip, std::uint32_t face, PaddedVector& center);
  // Sets where a contact's skin point is and how it answers, in the skin's pose.
  SkinHit place(Contact& contact, const PaddedVector& center) const;

 private:
  struct Touch {
    SkinHit hit;
    bool from_front;
    double depth_mm;
    double free_share;
  };
  void keep_boxes(const PaddedVectors& x);
  void mark_beyond(const PaddedVectors& x, const PaddedVector& low, const PaddedVector& high);
  bool update(const TipPose& tip, Contact& contact);
  double violation(const Contact& contact) const;
  void touch(const InstrumentSweep& sweep, const TipPose& tip, std::uint32_t face);
  void admit(const InstrumentSweep& sweep, double fraction, const Touch& touch,
             std::vector<Contact>& contacts);
  bool borders_front(std::uint32_t face) const;

  Skin& skin_;
  const Tissue& tissue_;
  std::vector<std::vector<std::uint32_t>> near_;
  std::vector<Skin::Box> boxes_;                  // of the smooth faces, with some slack for motion
  PaddedVectors x_of_boxes_;                      // mm: the shape that they were last looked at in
  std::vector<double> slack_left_mm_, moved_mm_;  // by face; by slot
  std::vector<std::uint8_t> beyond_;              // by slot: sides of the box that it lies beyond
  std::vector<Touch> touches_;
  std::vector<std::uint32_t> front_mark_;  // by slot: on a face that the tip holds from the front
  std::uint32_t mark_ = 0;
};

// The skin points that a closing grasper carries: the nearest one when it lies within two radii,
// and lattice nodes within the radius, spread out. Each keeps its place relative to the tip. False
// where it closed on skin and holds none: anchors do.
bool close_grasper(const InstrumentSweep& sweep, const std::vector<std::uint32_t>& faces,
                   const ContactSearch& search, Skin& skin, std::vector<Contact>& contacts);
// By as much as jaws close in a step.
void close_jaws(double time_step_s, std::vector<Contact>& contacts);

// Ties the points from `first` on to the tip that carries them, as the skin lies, and to each other
// (CarrierResponse). Drops those that cannot give way.
void tie_to_grasper(const PaddedVector& center, const ContactSearch& search, const Skin& skin,
                    std::vector<Contact>& contacts, std::size_t first);

// What an instrument carries or has gone through, and where that point of the skin lies at rest.
struct HeldContact {
  Contact contact;
  PaddedVector at_rest;
};

// Those of the contacts that last. The skin is left as it lies in the shape x.
std::vector<HeldContact> held_contacts(const std::vector<Contact>& contacts, Skin& skin,
                                       const PaddedVectors& rest, const PaddedVectors& x);

// A skin in the shape x, where it is left.
struct PosedSkin {
  Skin& skin;
  const PaddedVectors& x;
};

// Has the instruments hold another skin of the same organs, as blades have cut it, by its points
// that lie nearest at rest. What cannot give way there is let go.
void hold_anew(const std::vector<HeldContact>& held, const std::vector<Instrument>& instruments,
               const ContactSearch& search, const PosedSkin& posed, std::vector<Contact>& contacts);

// At the end of a step: what a needle has pushed in far enough it goes through there, and holds the
// skin from then on by that one contact; what its point was drawn out of it leaves. Returns the
// contacts by which needles pushed what they went through.
std::vector<Contact> let_needles_through(const std::vector<InstrumentSweep>& sweeps,
                                         std::vector<Contact>& contacts);

// A step's shape as graspers have pulled it, mm by slot, and how large the largest organ is.
struct PulledShape {
  const PaddedVectors &now, &at_start, &rest;
  double diagonal_mm;
};

// What grasps of each organ hold, N; 0: any.
using GraspStrengths = std::vector<double>;

bool any_carried(const std::vector<Contact>& contacts);

// Whether tissue would have to follow its graspers beyond any shape, because they are too far away
// or contradict each other.
bool pulled_too_far(const std::vector<Contact>& contacts, const PulledShape& shape);

// The instrument that carries with the largest force; the first one where they are not finite. One
// must carry.
std::uint32_t most_loaded(const std::vector<Contact>& contacts);

// The instrument that carries with a larger force than its grasp of the tissue holds, if any; of
// several the one beyond its strength by most.
std::optional<std::uint32_t> overloaded(const std::vector<Contact>& contacts, const Tissue& tissue,
                                        const GraspStrengths& strength_n);

}  // namespace organbake::deform
