// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "body/skin.h"
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
  SkinHit deepest(const TipPose& tip, std::uint32_t face, PaddedVector& center);
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

}  // namespace organbake::deform
