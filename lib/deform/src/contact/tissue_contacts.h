// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "body/skin.h"
#include "body/tissue.h"
#include "contact/contact.h"
#include "contact/contact_search.h"
#include "contact/padded_vector.h"

namespace organbake::deform {

struct FacePair {
  std::uint32_t a = 0, b = 0;
};

// A hierarchy of boxes over the proxies' faces, for tissue that may meet tissue. Boxes hold the
// skin over their faces. Beside them cones hold the directions that faces look in: parts that look
// the same way, within a right angle, cannot meet (Volino & Thalmann 1994), so that a smooth organ
// costs next to nothing.
class FaceTree {
 public:
  FaceTree(const Tissue& tissue, Skin& skin);

  // The pairs of faces in the skin's pose that may meet: their skins' boxes come within margin_mm
  // of each other and they look against each other; of one piece they share no vertex and were no
  // front and back of the same flesh at rest.
  void find_pairs(double margin_mm, std::vector<FacePair>& pairs);

 private:
  struct Box {
    PaddedVector low, high;
    bool meets(const Box& other) const {
      return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
    }
  };
  using Prism = std::array<PaddedVector, 6>;  // Skin::skin_prism
  struct Cone {
    PaddedVector axis;
    Angle half;  // half a turn holds everything
  };
  struct Node {
    std::uint32_t first = 0, last = 0;  // of order_
    std::uint32_t left = 0, right = 0;  // 0: a leaf
    Box box;
    Cone cone;
  };
  std::uint32_t piece_in_tree(std::uint32_t face) const;
  std::uint32_t build(std::uint32_t first, std::uint32_t last);
  std::uint32_t split(std::uint32_t first, std::uint32_t last);
  void fit(double margin_mm);
  void fit_leaf(Node& node);
  void join(Node& node) const;
  void meet_itself(std::uint32_t node, std::vector<FacePair>& pairs) const;
  void meet(std::uint32_t a, std::uint32_t b, std::vector<FacePair>& pairs) const;
  void meet_faces(std::uint32_t f, std::uint32_t g, std::vector<FacePair>& pairs) const;
  bool apart_along(const PaddedVector& normal, const Prism& own, const Prism& other) const;
  bool front_and_back_at_rest(std::uint32_t f, std::uint32_t g) const;

  const Tissue& tissue_;
  Skin& skin_;
  PaddedVectors rest_center_, rest_normal_;  // of the faces
  std::vector<std::uint32_t> order_;         // faces
  std::vector<Node> nodes_;                  // parents before their children
  std::vector<Box> box_;                     // of the faces' skin, now
  PaddedVectors normal_;
  double margin_mm_ = 0;
};

// Finds where skin has sunk below other skin, of another organ or of a fold of its own. Points
// spread over every face feel for the faces that the hierarchy brings near: one in the prism of a
// face's shell knows its height over it, and what has gone below that face's skin becomes a contact
// of the two skin points. It must have been seen in front of that skin before, or the far side of
// the same flesh would count. Organs that overlap at rest may do so by as much wherever they slide,
// or they would catch on their own rest. Faces that share a vertex don't meet: the springs keep
// them open.
//
// Pieces that are cut apart meet by their skin and by the walls of their cuts, which lie on each
// other from the first, and they may come from anywhere: whether a point has sunk into another
// piece is told by how that piece's faces wind about it.
class TissueContacts {
 public:
  static constexpr std::size_t kMost = 48;

  // All outlive this. diagonal_mm: how large what may meet is.
  TissueContacts(Skin& skin, const Tissue& tissue, const ContactSearch& search, double diagonal_mm);
  ~TissueContacts();

  // Back to what was in front of what at rest.
  void reset();
  // Before the first refresh of a time step.
  void begin_step() { ++step_; }
  // Whether a contact holds pieces apart of which one was cut off.
  bool parts_pieces(const Contact& contact) const;
  // Which skin came from the front so far, to go back to.
  struct Sides {
    std::vector<std::uint8_t> in_front, released;
  };
  Sides sides() const { return {in_front_, released_}; }
  void go_back_to(const Sides& sides);
  template <class Self, class Tape>
  static void pass(Self& self, Tape& tape) {
    tape(self.x_of_pairs_, self.x_probed_, self.clearance_mm_, self.watched_, self.in_front_,
         self.released_);
  }
  void be_restored();  // by a tape: finds again what is known of a pose
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
  struct ProbeBall {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double radius_mm = -1;  // < 0: not known in this pose
  };
  const ProbeBall& ball_of(std::uint32_t face);
  void spread_probes();
  void measure_rest();
  void find_pairs();
  void list_pairs();
  void list_near_watched();
  void forget_prisms();
  void probe(std::uint32_t face, std::uint32_t other);
  bool feel(std::uint32_t probe, const Prism& prism);
  void probe_all();
  void probe_watched();
  void see_front(std::uint32_t probe);
  void watch_nearest(const std::vector<Contact>& contacts, std::size_t count);
  const Prism& prism_of(std::uint32_t face);
  bool between_pieces(std::uint32_t face, std::uint32_t other) const;
  bool is_inside(std::uint32_t probe);
  double touching_mm(std::uint32_t probe) const;
  // Of which two pieces, into overlap_mm_.
  std::size_t piece_pair(std::uint32_t face, std::uint32_t other) const {
    return tissue_.piece_of_face(face) * tissue_.pieces().size() + tissue_.piece_of_face(other);
  }
  double allowed_mm(std::uint32_t probe) const;
  double sunk_mm(std::uint32_t probe) const;
  double clearance_mm() const;
  bool is_crowded(const Contact& made, const std::vector<Contact>& contacts) const;
  void update(Contact& contact) const;

  Skin& skin_;
  const Tissue& tissue_;
  const ContactSearch& search_;
  double margin_mm_, crowd_mm_;
  FaceTree tree_;
  std::vector<SkinPoint> probes_;
  std::vector<std::uint32_t> first_probe_;  // by face, and the end
  std::vector<FacePair> pairs_;
  std::vector<std::uint32_t> first_beside_, beside_;  // by face, its partners in pairs, and the end
  PaddedVectors x_of_pairs_;                          // mm; empty: not searched yet
  PaddedVectors x_probed_;                            // where all were probed, and
  double clearance_mm_ = 0;                           // what was left then of those
  std::vector<std::uint32_t> watched_;                // that are not among these probes, increasing
  std::vector<std::size_t>
      first_near_;  // by watched probe, the faces that it may meet, and the end
  std::vector<std::uint32_t> near_;
  std::vector<double> overlap_mm_;     // of two pieces at rest, by how much the deepest point
  std::vector<double> rest_depth_mm_;  // in another piece, by probe
  std::vector<std::vector<std::uint32_t>> piece_faces_;
  std::vector<std::size_t> outside_in_step_;  // by probe: the step that last found it outside
  std::size_t step_ = 0;
  std::vector<Prism> prisms_;                // of the pose, made when asked for
  std::vector<std::uint32_t> prism_number_;  // by face; none yet: kNoPrism
  std::vector<Probed> probed_;
  std::vector<SkinHit> own_;      // each probe's place in the pose, made when asked for
  std::vector<ProbeBall> balls_;  // by face, of its probes
  std::vector<std::uint8_t> in_front_, in_front_at_rest_;  // of other skin, by probe
  std::vector<std::uint8_t> released_;                     // counts for nothing until it has parted
  std::vector<std::uint32_t> touched_;  // probes that felt something, in increasing order
};

}  // namespace organbake::deform
