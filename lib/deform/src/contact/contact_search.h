// SPDX-License-Identifier: Apache-2.0
#pragma once

// Who meets whom: where tools press into the skin, where tissue meets tissue, and what holds tools
// off each other and off skin that cannot give way.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "body/skin.h"
#include "body/tissue.h"
#include "contact/contact.h"
#include "contact/padded_vector.h"
#include "organbake/instruments/instrument.h"

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
  // Where a skin point that lies at `point` would lie with its face's vertices, or the carriers, at
  // rest.
  PaddedVector anchored(const SkinPoint& at, const PaddedVector& point) const;
  PaddedVector anchored(std::span<const Carrier> carriers, PaddedVector point) const;
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

// Skin that anchors hold is a wall to probes, which stop at it; skin that gives way at all is held
// off by contacts (ContactSearch). Other tools pass: blades and needles part it, graspers hold it.
class AnchoredSkin {
 public:
  // Both outlive this.
  AnchoredSkin(Skin& skin, ContactSearch& search);

  // Where a probe stands at the wall.
  struct Touch {
    std::uint32_t instrument;
    SkinHit hit;
    Eigen::Vector3d outward;  // unit, from the skin to the probe
  };
  // In the skin's pose, before each step. In how many pieces a probe's way is to be followed so
  // that it ends on the side of the skin that it began on; 0: it comes near none.
  void begin_step() { touches_.clear(); }
  int pieces_between(const Instrument& from, const Instrument& to) const;
  // Moves a probe out of the wall, to the side on which it stands or, of one that is just placed,
  // to the outside.
  void push_off(std::uint32_t number, bool just_placed, Instrument& tip);
  const std::vector<Touch>& touches() const { return touches_; }  // of the last push of each

 private:
  struct Face {
    std::uint32_t face;
    Eigen::Vector3d center_mm;  // of a ball that holds its skin
    double radius_mm;
  };
  struct Overlap {
    Touch touch;
    double depth_mm = 0;
  };
  std::optional<Overlap> deepest(std::uint32_t number, bool just_placed, const Instrument& tip);

  Skin& skin_;
  ContactSearch& search_;
  std::vector<Face> faces_;  // any point of which cannot give way
  std::vector<Touch> touches_;
};

// Tools are hard: tips that would lie in each other are moved apart, each by half, until they
// touch. Inactive tips stay out of it. Many tools pressed together may keep a little overlap.
std::vector<Instrument> held_apart(std::vector<Instrument> tips);

// The same on the way from where tips were held to where they are asked for, piece by piece, so
// that neither a fast tool passes through another nor one that keeps being pushed. A tip that was
// not there before starts where it is asked for; one that meets none ends there. Probes stop at
// anchored skin, where there is some.
std::vector<Instrument> moved_apart(const std::vector<Instrument>& held,
                                    const std::vector<Instrument>& asked,
                                    AnchoredSkin* anchored = nullptr);

// Pairs of tips that touch.
std::size_t count_touching(const std::vector<Instrument>& tips);

// The parameters (0…1) of the nearest points of two segments, each from its `at` along its `way`,
// which may be zero.
struct NearestOnSegments {
  double first = 0, second = 0;
};
NearestOnSegments nearest_on_segments(const Eigen::Vector3d& first_at,
                                      const Eigen::Vector3d& first_way,
                                      const Eigen::Vector3d& second_at,
                                      const Eigen::Vector3d& second_way);

}  // namespace organbake::deform
