// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "contact/padded_vector.h"
#include "organbake/deform/deformer.h"
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

// Four 3×3 matrices side by side: entry (row i, column j) of each in [3 i + j].
struct Matrices {
  Double4 entries[9] = {};
  Double4& operator[](int entry) { return entries[entry]; }
  const Double4& operator[](int entry) const { return entries[entry]; }
};

// The rotations nearest to four matrices (Frobenius): the polar factor, by Newton's iteration with
// Higham's scaling (1986). A matrix that is inside out or flat has its nearest rotation from a
// singular value decomposition instead, the smallest value's sign turned (Irving et al. 2004), so
// that an inverted element is led back the shortest way. Not finite in, anything finite out.
void nearest_rotations(const Matrices& f, Matrices& rotation);

// What four elements store by their deformation F, side by side. In the singular values s of F (the
// least one negative where F is inside out) and with R the rotation nearest to F,
//   W = shear/2 |s − 1|² + 3 bulk/2 |s − s*|²,   shear = 2 μ V, bulk = λ V,
// s* being the nearest values that sum up to 3 and are none below kLeastStretch. Where that bound
// doesn't bite, the second part is bulk/2 (tr RᵀF − 3)²: linear corotational elasticity. That alone
// takes s = (2, 2, −1) for a volume that is kept, and elements turned inside out would stay so.
// Both parts are squared distances, so that W bends by at most shear + 3 bulk, whatever F.
class ElementStress {
 public:
  // Keeps f by reference.
  explicit ElementStress(const Matrices& f);

  // ∂W/∂F.
  void stress(const Double4& shear, const Double4& bulk, Matrices& stress) const;
  // The same of a viscosity of shear strain (mN·mm): R sym(Rᵀ (F − F_start)) viscosity.
  void add_viscous(const Double4& viscosity, const Matrices& f_start, Matrices& stress) const;
  Double4 energy(const Double4& shear, const Double4& bulk) const;

  static constexpr double kLeastStretch = 0.1;

 private:
  void keep_volume();
  void keep_volume_of_lane(int lane);

  const Matrices& f_;
  Matrices rotation_;
  Matrices from_kept_;  // 3 (F − F*)
};

// Linear corotational finite elements (Müller & Gross 2004; its energy as Chao et al. 2010 have it)
// in the springs' place, with the tissue's modulus and density and the body's Poisson's ratio: W is
// that of element_stress.h, for small displacements linear elasticity. Steps lead along
// A = M/dt² + Σ V (2μ (1 + damping/dt) + 3/2 λ) ∇φᵢ·∇φⱼ, at least half of what W bends by however
// elements are turned: each lowers the energy, and what they converge to is the backward Euler step
// itself. The points are the nodes; they carry the proxy's vertices.
class FemBody final : public Tissue {
 public:
  // Throws UsageError when one's mechanics hold no tetrahedra.
  FemBody(const DeformBodies& bodies, double time_step_s, double stiffness = 1);

  void local_step(const PaddedVectors& x, const PaddedVectors& x_start,
                  const PaddedVectors& x_coasted, PaddedVectors& force) const override;
  double energy(const PaddedVectors& x, const PaddedVectors& x_start) const override;

 private:
  // Four elements side by side.
  struct Block {
    std::array<std::array<std::uint32_t, 4>, 4> slots{};  // [element][corner]
    Matrices gradients{};                                 // row k: ∇φ of corner k + 1, 1/mm
    Double4 shear{}, bulk{};                              // 2 μ V and λ V, mN·mm
    Double4 viscous{};                                    // 2 μ V damping/dt, mN·mm
  };
  struct Solid;
  void place_slots(const Solid& solid, const std::vector<std::uint32_t>& free_of_node);
  void place_elements(const Solid& solid);
  void find_pieces(const Solid& solid, const DeformBodies& bodies);
  static Matrices deformation_of(const Block& block, const Double4* at);
  static void push(const Block& block, const Matrices& stress, Double4* force);

  bool damped_ = false;
  std::vector<Block> blocks_;  // filled up with elements that do nothing
};

// Springs, dampers and masses of a proxy as projective dynamics sees them (Bouaziz et al. 2014): an
// implicit Euler step minimises ½|x − y|²_M/dt² + Σ ½k|e − l d|² + Σ ½c/dt (d·Δe)², e = x_a − x_b,
// and with each spring's direction d and the sideways part of Δe held (they are the local step),
// the minimiser solves A u = b, A constant, u = x − rest. Dampers act along their springs, as the
// paper's do: acting on the whole relative velocity they would slow rotation, and a poked organ
// would creep. Every point is a proxy vertex.
class SpringNetwork final : public Tissue {
 public:
  SpringNetwork(const DeformBodies& bodies, double time_step_s, double stiffness = 1);

  // The forces of inertia, springs and dampers.
  void local_step(const PaddedVectors& x, const PaddedVectors& x_start,
                  const PaddedVectors& x_coasted, PaddedVectors& force) const override;
  double energy(const PaddedVectors& x, const PaddedVectors& x_start) const override;

 private:
  struct Ends {
    std::uint32_t a = 0, b = 0;  // slots, a < b
  };
  struct SpringBlock;
  void measure_block(std::size_t begin, const Double4* at, const Double4* from,
                     SpringBlock& block) const;
  void stand_in(std::size_t spring, const Double4* from, SpringBlock& block, int i) const;
  void pull_block(std::size_t begin, SpringBlock& block) const;
  struct Net;
  std::vector<Coefficient> matrix_of_free(const Net& net, double time_step_s,
                                          const std::vector<std::uint32_t>& free_of_vertex) const;
  void place_slots(const Net& net, double time_step_s,
                   const std::vector<std::uint32_t>& free_of_vertex);
  void place_springs(const Net& net, double time_step_s);
  void find_parts(const Net& net);

  // In order of their slots, filled up to whole blocks with springs that do nothing.
  std::vector<Ends> ends_;
  std::vector<double> length_, stiffness_, damper_;  // l, mm; k, kg/s²; c/dt, kg/s²
};

// What stands for some bodies: springs, or finite elements. Throws UsageError for tetrahedra that
// are asked for and not there.
std::unique_ptr<const Tissue> make_tissue(const DeformBodies& bodies, const DeformOptions& options);

}  // namespace organbake::deform
