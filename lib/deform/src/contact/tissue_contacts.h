// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "body/skin.h"
#include "contact/contact.h"
#include "contact/contact_search.h"
#include "contact/face_tree.h"

namespace organbake::deform {

// Finds where skin has sunk below other skin, of another organ or of a fold of its own. Points
// spread over every face feel for the faces that the hierarchy brings near: one in the prism of a
// face's shell knows its height over it, and what has gone below that face's skin becomes a contact
// of the two skin points. It must have been seen in front of that skin before, or the far side of
// the same flesh would count. Organs that overlap at rest may do so by as much wherever they slide,
// or they would catch on their own rest. Faces that share a vertex don't meet: the springs keep
// them open.
class TissueContacts {
 public:
  static constexpr std::size_t kMost = 48;

  // All outlive this. diagonal_mm: how large what may meet is.
  TissueContacts(Skin& skin, const Tissue& tissue, const ContactSearch& search, double diagonal_mm);

  // Back to what was in front of what at rest.
  void reset();
  // Which skin came from the front so far, to go back to.
  struct Sides {
    std::vector<std::uint8_t> in_front, released;
  };
  Sides sides() const { return {in_front_, released_}; }
  void go_back_to(const Sides& sides);
  // Lets go of everything that touches, until it has parted: a crumpled fold that only its own
  // contacts keep shut has run partly through itself.
  void untangle(std::vector<Contact>& contacts);
  // Brings the contacts of tissue with tissue up to date with the skin's pose, adds the missing
  // ones, and returns the deepest penetration (mm) beyond what rest has.
  double refresh(std::vector<Contact>& contacts);

 private:
  struct Probed {  // by one probe
    SkinHit other;
    double depth_mm = 0;  // below the other skin, < 0 above it
    bool found = false, has_contact = false;
  };
  struct Prism;
  void spread_probes();
  void measure_rest();
  void find_pairs();
  void probe(std::uint32_t face, std::uint32_t other);
  void probe_all();
  void see_fronts();
  // Of which two organs, into overlap_mm_.
  std::size_t organ_pair(std::uint32_t face, std::uint32_t other) const {
    return tissue_.organ_of_face(face) * organ_count_ + tissue_.organ_of_face(other);
  }
  double allowed_mm(std::uint32_t probe) const;
  double sunk_mm(std::uint32_t probe) const;
  double clearance_mm() const;
  void update(Contact& contact) const;

  Skin& skin_;
  const Tissue& tissue_;
  const ContactSearch& search_;
  double margin_mm_;
  FaceTree tree_;
  std::vector<SkinPoint> probes_;
  std::vector<std::uint32_t> first_probe_;  // by face, and the end
  std::vector<FacePair> pairs_;
  PaddedVectors x_of_pairs_;  // mm; empty: not searched yet
  PaddedVectors x_probed_;    // where nothing touched, and
  double clearance_mm_ = 0;   // what was left then
  std::size_t organ_count_ = 1;
  std::vector<double> overlap_mm_;  // of two organs at rest, by how much the deepest point
  std::vector<Probed> probed_;
  std::vector<SkinHit> own_;  // each probe's place in the pose, made when asked for
  std::vector<std::uint8_t> has_own_;
  std::vector<std::uint8_t> in_front_, in_front_at_rest_;  // of other skin, by probe
  std::vector<std::uint8_t> released_;                     // counts for nothing until it has parted
  std::vector<std::uint32_t> touched_;  // probes that felt something, in increasing order
};

}  // namespace organbake::deform
