// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "bundle/mechanics_model.h"
#include "deform/rows.h"
#include "deform/sparse_factor.h"
#include "geometry/triangle_mesh.h"

namespace organbake::deform {

// Units inside the solver are kg, mm, s, so forces are kg·mm/s² = mN: 1 N/mm = 1000 kg/s².
inline constexpr double kMilliNewtonPerNewton = 1000;

// Springs, dampers and masses of a proxy as projective dynamics sees them (Bouaziz et al. 2014): an
// implicit Euler step minimises ½|x − y|²_M/dt² + Σ ½k|e − l d|² + Σ ½c/dt (d·Δe)², e = x_a − x_b,
// and with each spring's direction d and the sideways part of Δe held (they are the local step),
// the minimiser solves A u = b, A constant, u = x − rest. Dampers act along their springs, as the
// paper's do: acting on the whole relative velocity they would slow rotation, and a poked organ
// would creep.
//
// Vertices are renumbered into slots: free ones first, in the factor's elimination order, then the
// anchors, whose u is 0 always, so no right side ever needs them.
class SpringNetwork {
 public:
  // Throws BadDataError for a model that does not fit the proxy or has a value out of range.
  SpringNetwork(const TriangleMesh& proxy, const MechanicsModel& mechanics, double time_step_s);

  std::size_t size() const { return rest_.size(); }
  std::size_t free_count() const { return factor_.size(); }
  const std::vector<std::uint32_t>& slot_of_vertex() const { return slot_of_vertex_; }
  const Rows& rest() const { return rest_; }                 // mm, by slot
  const std::vector<Face>& faces() const { return faces_; }  // of slots
  const SparseFactor& factor() const { return factor_; }
  // Connected parts, through springs or faces, numbered by their first vertex.
  const std::vector<std::uint32_t>& part_of_slot() const { return part_of_slot_; }
  std::uint32_t part_count() const { return part_count_; }
  // Σ k l²/9 of each part: the stiffness (mN·mm) of its springs against a change of volume strain.
  const std::vector<double>& bulk_energy() const { return bulk_energy_; }
  // False when some spring is not at its rest length at rest: then rest is no equilibrium.
  bool relaxed_at_rest() const { return relaxed_at_rest_; }

  // The local step at x (mm) of a step from x_start that inertia alone would end at x_coasted: the
  // forces (mN) of inertia, springs and dampers that are left there, free vertices only. A solves
  // them for the way to the minimiser with the directions of x: b − A u, so that a factor that is
  // slightly off costs no accuracy where the steps converge.
  void local_step(const Rows& x, const Rows& x_start, const Rows& x_coasted, Rows& force) const;
  // Kinetic energy of the step from x_start to x, and what the springs hold at x (mN·mm = µJ).
  double energy(const Rows& x, const Rows& x_start) const;

 private:
  struct Ends {
    std::uint32_t a = 0, b = 0;  // slots, a < b
  };
  struct SpringBlock;
  void measure_block(std::size_t begin, const Lanes* at, const Lanes* from,
                     SpringBlock& block) const;
  void stand_in(std::size_t spring, const Lanes* from, SpringBlock& block, int i) const;
  void pull_block(std::size_t begin, SpringBlock& block) const;
  std::vector<Coefficient> matrix_of_free(const MechanicsModel& mechanics, double time_step_s,
                                          const std::vector<std::uint32_t>& free_of_vertex) const;
  void place_slots(const TriangleMesh& proxy, const MechanicsModel& mechanics, double time_step_s,
                   const std::vector<std::uint32_t>& free_of_vertex);
  void place_springs(const MechanicsModel& mechanics, double time_step_s);
  void find_parts(const MechanicsModel& mechanics);

  SparseFactor factor_;
  std::vector<std::uint32_t> slot_of_vertex_, part_of_slot_;
  std::uint32_t part_count_ = 0;
  std::vector<double> bulk_energy_;
  Rows rest_;
  std::vector<Face> faces_;
  std::vector<double> inertia_;  // m/dt², kg/s²
  // In order of their slots, filled up to whole blocks with springs that do nothing.
  std::vector<Ends> ends_;
  std::vector<double> length_, stiffness_, damper_;  // l, mm; k, kg/s²; c/dt, kg/s²
  bool relaxed_at_rest_ = true;
};

}  // namespace organbake::deform
