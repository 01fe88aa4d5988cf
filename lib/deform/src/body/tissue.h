// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "contact/padded_vector.h"
#include "organbake/geometry/triangle_mesh.h"
#include "solver/sparse_factor.h"

namespace organbake::deform {

// What a point follows, by a share of its motion.
struct Carrier {
  std::uint32_t slot;
  double weight;
};

// Points that have no motion of their own. They stand in a row of slots behind the free ones, so
// that skin and contacts meet them like any other; what pushes them pushes their carriers.
class Embedding {
 public:
  Embedding() = default;
  // The points get the slots from `first_slot` on; carriers with lower slots are free, all others
  // are anchors.
  Embedding(std::uint32_t first_slot, const std::vector<std::vector<Carrier>>& points);

  std::size_t count() const { return free_shares_.size(); }
  double free_share(std::uint32_t slot) const { return free_shares_[slot - first_slot_]; }

  // Sets the carried rows of displacements from their carriers', anchors' taken for 0.
  void carry(PaddedVectors& displacements) const;
  // The same for positions (mm), by how far the carriers are from rest.
  void carry_positions(const PaddedVectors& rest, PaddedVectors& x) const;
  // Adds to one lane of the free rows what a unit force on a carried slot does to them.
  void spread_force(std::uint32_t slot, double force, Eigen::Index lane, PaddedVectors& rows) const;
  // Moves the forces on carried rows to their free carriers.
  void spread(PaddedVectors& force) const;

 private:
  std::span<const Carrier> carriers_of(std::size_t point) const {
    return std::span(carriers_).subspan(first_[point], first_[point + 1] - first_[point]);
  }

  std::uint32_t first_slot_ = 0;
  std::vector<std::uint32_t> first_ = {0};  // of each point's carriers, and the end
  std::vector<Carrier> carriers_;           // that are free
  std::vector<double> free_shares_;
};

// Skin that lies on its tissue by springs with dampers beside them: what presses on it moves it
// beyond what carries it, as far as a dent is narrower than what carries it can show. Each place of
// the skin as it was baked has one, and points of the skin follow places by shares of their motion.
class SkinGive {
 public:
  struct Place {
    double mm_per_mn = 0;  // by a force in one step
    double kept = 0;       // share of how far it has given way that is left after a step
  };

  SkinGive() = default;
  // shares: of the points in the slots from first_slot on, by places.
  SkinGive(std::uint32_t first_slot, std::vector<Place> places,
           const std::vector<std::vector<Carrier>>& shares);

  // The places that a slot follows; none of one that is no point of the skin.
  std::span<const Carrier> places_of(std::uint32_t slot) const;
  double mm_per_mn(std::uint32_t place) const { return places_[place].mm_per_mn; }
  // How far the places have given way (mm) where nothing has yet.
  PaddedVectors none() const { return PaddedVectors(places_.size(), PaddedVector::Zero()); }
  // The same a step later, when nothing presses on them any more.
  void relax(PaddedVectors& given) const;
  // Moves the points of the skin by what their places have given way.
  void move_points(const PaddedVectors& given, PaddedVectors& x) const;

 private:
  std::uint32_t first_slot_ = 0;
  std::vector<Place> places_;
  std::vector<std::uint32_t> first_ = {0};  // of each point's shares, and the end
  std::vector<Carrier> shares_;
  // By place, the points that follow it: a tool moves few places of a skin.
  std::vector<std::vector<Carrier>> followers_;
};

inline constexpr std::uint32_t kAnchored = 0xFFFFFFFFu;

// Numbers the points that are no anchors from 0 on; anchors get kAnchored.
std::vector<std::uint32_t> number_free(std::size_t points,
                                       const std::vector<std::uint32_t>& anchors);
// The same, in an order that has each of them once.
std::vector<std::uint32_t> number_free_in_order(std::size_t points,
                                                const std::vector<std::uint32_t>& order);
std::size_t count_free(const std::vector<std::uint32_t>& free_of_point);

// Units inside the solver are kg, mm, s, so forces are kg·mm/s² = mN: 1 N/mm = 1000 kg/s².
inline constexpr double kMilliNewtonPerNewton = 1000;

// What is deformed, as the solver sees it: points with inertia and forces between them. An implicit
// Euler step minimises ½|x − y|²_M/dt² + W(x); A u = force, A constant and the same along x, y and
// z, leads from any shape towards the minimiser (projective dynamics: Bouaziz et al. 2014; as a
// quasi-Newton method: Liu et al. 2017).
//
// Points are numbered by slots: free ones first, in the factor's elimination order, then those that
// others carry (a proxy embedded in tetrahedra), then the anchors, which never move.
class Tissue {
 public:
  virtual ~Tissue() = default;

  std::size_t size() const { return rest_.size(); }
  std::size_t free_count() const { return factor_.size(); }
  std::size_t moving_count() const { return free_count() + embedding_.count(); }  // free, carried
  const std::vector<std::uint32_t>& slot_of_vertex() const { return slot_of_vertex_; }
  // Of the tetrahedra's nodes, one organ's after the other's; springs have none.
  const std::vector<std::uint32_t>& slot_of_node() const { return slot_of_node_; }
  const PaddedVectors& rest() const { return rest_; }        // mm, by slot
  const std::vector<Face>& faces() const { return faces_; }  // of slots
  const SparseFactor& factor() const { return factor_; }
  const Embedding& embedding() const { return embedding_; }
  const SkinGive& give() const { return give_; }
  // How much of a point gives way: 1 when free, 0 for an anchor, between where anchors help to
  // carry.
  double free_share(std::uint32_t slot) const {
    if (slot < free_count()) return 1;
    return slot < moving_count() ? embedding_.free_share(slot) : 0;
  }
  // Which of the bodies that the tissue was made from.
  const std::vector<std::uint32_t>& organ_of_slot() const { return organ_of_slot_; }
  std::uint32_t organ_of_face(std::uint32_t face) const { return organ_of_slot_[faces_[face][0]]; }
  // Pieces that tissue may lie in, which meet as organs do: every organ is one, and of one that
  // blades have cut every part that hangs together. `cut`: of such an organ.
  struct Piece {
    bool cut = false, held = false;  // by an anchor
    std::uint32_t organ = 0;
  };
  const std::vector<Piece>& pieces() const { return pieces_; }
  std::uint32_t piece_of_slot(std::uint32_t slot) const { return piece_of_slot_[slot]; }
  std::uint32_t piece_of_face(std::uint32_t face) const { return piece_of_slot_[faces_[face][0]]; }
  // Connected parts, through springs or faces, numbered by their first vertex; of tissue whose
  // volume a pressure keeps.
  const std::vector<std::uint32_t>& part_of_slot() const { return part_of_slot_; }
  std::uint32_t part_count() const { return part_count_; }
  // The stiffness (mN·mm) of each part against a change of volume strain.
  const std::vector<double>& bulk_energy() const { return bulk_energy_; }
  // False when rest is no equilibrium.
  bool relaxed_at_rest() const { return relaxed_at_rest_; }

  // The local step at x (mm) of a step from x_start that inertia alone would end at x_coasted: the
  // forces (mN) that are left there, free points only, the other rows 0. A solves them for the way
  // towards the minimiser, so that a factor that is slightly off costs no accuracy where the steps
  // converge.
  virtual void local_step(const PaddedVectors& x, const PaddedVectors& x_start,
                          const PaddedVectors& x_coasted, PaddedVectors& force) const = 0;
  // Kinetic energy of the step from x_start to x, and what the tissue holds at x (mN·mm = µJ).
  virtual double energy(const PaddedVectors& x, const PaddedVectors& x_start) const = 0;

 protected:
  Tissue() : factor_(0, {}) {}

  // What every local step begins with: the forces of inertia on free points, 0 in the other rows.
  void put_inertia(const PaddedVectors& x, const PaddedVectors& x_coasted,
                   PaddedVectors& force) const;
  double twice_kinetic_energy(const PaddedVectors& x, const PaddedVectors& x_start) const;  // mN·mm
  // From organ_of_slot_: every organ is one piece.
  void take_organs_for_pieces();

  SparseFactor factor_;
  Embedding embedding_;
  SkinGive give_;
  std::vector<std::uint32_t> slot_of_vertex_, slot_of_node_, organ_of_slot_, part_of_slot_;
  std::uint32_t part_count_ = 0;
  std::vector<Piece> pieces_;
  std::vector<std::uint32_t> piece_of_slot_;
  std::vector<double> bulk_energy_;
  std::vector<double> inertia_;  // m/dt² by slot, kg/s²; of free points at least
  PaddedVectors rest_;
  std::vector<Face> faces_;
  bool relaxed_at_rest_ = true;
};

}  // namespace organbake::deform
