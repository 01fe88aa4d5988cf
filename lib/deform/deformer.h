// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "bundle/base_layer.h"
#include "bundle/mechanics_model.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

enum class InstrumentMode { poke, grab };

// A spherical tip (mm, world), or a capsule: all that lies within the radius of an axis that begins
// at the position. A grabbing tip carries the tissue that its sphere touched when it closed.
struct InstrumentTip {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  double radius_mm = 5;
  InstrumentMode mode = InstrumentMode::poke;
  bool active = false;
  Eigen::Vector3d axis_mm = Eigen::Vector3d::Zero();  // to the capsule's other end; zero: a sphere
};

// What stands for the tissue: the springs that every bundle has, or linear corotational finite
// elements on the tetrahedra of a bundle that was baked with them.
enum class TissueSolver { springs, fem };
const char* to_string(TissueSolver solver);

struct DeformOptions {
  TissueSolver solver = TissueSolver::springs;
  double time_step_s = 1.0 / 60;
  int iterations = 4;  // local/global iterations a step
  double friction = 0.3;

  void check() const;
};

struct StepReport {
  std::size_t contacts = 0;
  std::vector<Eigen::Vector3d> tip_force_n;  // on each instrument, from the tissue
  bool recovered = false;                    // a non-finite state was reset to rest, and said
  double penetration_mm = 0;                 // deepest skin point left inside a tip
};

// Mass-spring tissue by projective dynamics (Bouaziz et al. 2014; Liu et al. 2013), or finite
// elements in its place, with a Cholesky factor made once; contacts enter as constraints through
// the factor, so none refactorises.
class Deformer {
 public:
  // Throws UsageError for tetrahedra that are asked for and not there, BadDataError for data that
  // cannot be used. base (may be empty) gives the heights at which an instrument meets the true
  // skin.
  Deformer(const TriangleMesh& proxy, const MechanicsModel& mechanics, const BaseLayer& base,
           const DeformOptions& options = {});
  ~Deformer();
  Deformer(Deformer&&) noexcept;

  StepReport step(const std::vector<InstrumentTip>& tips);
  const std::vector<Eigen::Vector3d>& positions() const;  // proxy vertices, mm
  bool moved() const;  // whether any vertex changed in the last step
  void reset();
  // Dead loads from the next step on: a force (N, world) on each proxy vertex, or none when empty.
  // They outlast reset(). Throws UsageError for another count and for what is no force.
  void set_load(const std::vector<Eigen::Vector3d>& force_n);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
