// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/instruments/instrument.h"

namespace organbake {

// One organ as it is handed to the solver, at rest, as bundles hold it: what reads a bundle has
// checked it. Nothing of it is kept by reference. The true skin is met on the smooth skin over the
// proxy or, without one, at the heights of the base layer over it, which may be empty.
struct DeformBody {
  const TriangleMesh& proxy;
  const MechanicsModel& mechanics;
  const BaseLayer& base;
  const SmoothSkin* skin = nullptr;  // the base layer then lies over it and is not looked at
};

// Organs that lie in one world. Their proxies' vertices and faces are numbered one organ after the
// other.
using DeformBodies = std::vector<DeformBody>;

// What stands for the tissue: linear corotational finite elements on the tetrahedra of a bundle, or
// the springs that every bundle has.
enum class TissueSolver { springs, fem };
const char* to_string(TissueSolver solver);
std::optional<TissueSolver> tissue_solver(std::string_view name);  // nothing for another name

struct DeformOptions {
  // Nothing: finite elements where every organ has tetrahedra, else springs.
  std::optional<TissueSolver> solver = {};
  double time_step_s = 1.0 / 60;
  int iterations = 4;     // local/global iterations a step
  double friction = 0.3;  // of instruments on tissue; wet tissue slides on tissue
  double stiffness = 1;   // of the tissue, in multiples of what its mechanics say
  // Tissue holds off tissue: organs each other, and folds of an organ themselves.
  bool tissue_contacts = true;

  static constexpr double kSoftest = 0.05, kStiffest = 20;
  void check() const;
  // The same with the solver named that these bodies are played by.
  DeformOptions chosen_for(const DeformBodies& bodies) const;
};

// A point of the skin that an instrument holds off, or carries.
struct ContactPoint {
  std::size_t instrument = 0, organ = 0;
  Eigen::Vector3d position_mm;  // of the skin, world
  // Unit, from the tissue to the instrument; of a carried point along the force.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_n = Eigen::Vector3d::Zero();  // on the instrument
  // How far the skin lies from its place at rest, against the normal; of a carried point all round.
  double depth_mm = 0;
  bool carried = false;
};

// What a grasper holds: the point of the skin that was nearest to its tip when it closed.
struct Grip {
  std::size_t instrument = 0;
  Eigen::Vector3d position_mm, outward;  // world; of the skin, unit
  double closed = 0;                     // how far the jaws are, 0…1
};

struct StepReport {
  std::size_t contacts = 0;                  // of instruments
  std::size_t tissue_contacts = 0;           // of tissue with tissue
  std::size_t tool_contacts = 0;             // pairs of tools that hold each other off
  std::vector<Eigen::Vector3d> tip_force_n;  // on each instrument, from the tissue
  std::vector<ContactPoint> contact_points;  // `contacts` of them; a tip's force is their sum
  std::vector<ContactPoint> punctures;       // where needles went through the skin
  // Where each tip was held, world: tools that run into each other or into anchored skin stop
  // there.
  std::vector<Eigen::Vector3d> tip_position_mm;
  // A tip moved farther than can be followed, and may have passed through skin.
  bool tip_too_fast = false;
  // Graspers that lost what they held: they carry nothing until they close again.
  std::size_t slipped = 0;
  // Graspers that closed deep in tissue, where there is no skin to hold, or on skin that anchors
  // do.
  std::size_t closed_in_vain = 0;
  bool recovered = false;            // a non-finite state was reset to rest, and said
  double penetration_mm = 0;         // deepest skin point left inside a tip
  double tissue_penetration_mm = 0;  // or below other skin, deeper than at rest
  double collision_ms = 0;           // of the step's time: the search for contacts
};

// Mass-spring tissue by projective dynamics (Bouaziz et al. 2014; Liu et al. 2013), or finite
// elements in its place, with a Cholesky factor made once; contacts enter as constraints through
// the factor, so none refactorises.
class Deformer {
 public:
  // Throws UsageError for tetrahedra that are asked for and not there, BadDataError for masses and
  // stiffnesses that cannot be solved for. base (may be empty) gives the heights at which an
  // instrument meets the true skin.
  Deformer(const TriangleMesh& proxy, const MechanicsModel& mechanics, const BaseLayer& base,
           const DeformOptions& options = {});
  ~Deformer();
  Deformer(Deformer&&) noexcept;
  Deformer& operator=(Deformer&&) noexcept;

  // Several organs that meet each other. What overlaps at rest may stay as it is, no deeper.
  explicit Deformer(const DeformBodies& bodies, const DeformOptions& options = {});

  // Throws UsageError for instruments that make no sense (check_instruments), and has changed
  // nothing then. Instruments with blades push nothing, and are as if they were not there. Skin
  // that anchors hold is a wall to probes: they stop at it (tip_position_mm) and feel it, by how
  // far they were asked beyond, as an elastic half space of the tissue (Hertz 1882).
  StepReport step(const std::vector<Instrument>& instruments);
  // Of the proxies' vertices, one organ after the other, mm.
  const std::vector<Eigen::Vector3d>& positions() const;
  // Of an organ's tetrahedra, mm; none of springs.
  std::vector<Eigen::Vector3d> node_positions(std::size_t organ) const;
  // Goes on where another stands, of the same organs before blades have cut some of them: as they
  // lie and move there, with what instruments hold. sources: by organ, where each node of its
  // tetrahedra lay in those of `before`. Loads are dropped. rest_stays: what lay at rest sleeps on,
  // however it hangs together now; else a step is taken first, in which new walls may touch.
  void continue_from(Deformer& before, const std::vector<std::vector<NodeSource>>& sources,
                     bool rest_stays = false);
  // Lays an organ where another solver has brought it: its proxy's vertices, of springs, or its
  // tetrahedra's nodes, mm. It lies still there, its anchors at rest, and instruments begin anew
  // with what they touch. Throws UsageError for another count.
  void place(std::size_t organ, const std::vector<Eigen::Vector3d>& points_mm);
  // On each of the proxies' vertices, one organ after the other, by instruments in the last step:
  // N, world. What they press beside anchors is borne by the vertices that give way. Their sum over
  // an instrument's contacts is minus its tip_force_n.
  std::vector<Eigen::Vector3d> contact_force_n() const;
  std::vector<Grip> grips() const;  // of each grasper that holds something, in the last step
  bool moved() const;               // whether any vertex changed in the last step
  void reset();

  // All that is remembered from one step to the next: how the tissue lies and moves, what touches
  // and is held, loads, sleep. Copies share what they hold.
  class State {
   public:
    // Memory that it takes beside another, with which it shares what is the same in both.
    std::size_t bytes_beside(const State& other) const;
    struct Tape;

   private:
    friend class Deformer;
    std::shared_ptr<const Tape> tape_;
  };
  // earlier: a state to share with what has not changed since; may be empty.
  State save_state(const State& earlier = {}) const;
  // What follows is what followed when it was saved, to the last bit. It must come from this
  // deformer, or from one that was made of the same bodies and options.
  void restore_state(const State& state);

  // Dead loads from the next step on: a force (N, world) on each proxy vertex, or none when empty.
  // They outlast reset(). Throws UsageError for another count and for what is no force.
  void set_load(const std::vector<Eigen::Vector3d>& force_n);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
