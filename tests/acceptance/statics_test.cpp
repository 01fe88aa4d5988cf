// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "organbake/core/median.h"
#include "organbake/core/text.h"
#include "organbake/decimate/decimate.h"
#include "organbake/deform/deformer.h"
#include "organbake/mechanics/dead_loads.h"
#include "organbake/mechanics/linear_statics.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/mechanics/spring_fit.h"
#include "organbake/phantom/phantom.h"
#include "promises.h"

namespace organbake {
namespace {

struct Hold {
  int iterations, steps;
};

// Where the player's elements stand after so many steps under a dead load, mm from rest.
Eigen::VectorXd held_shape(const TriangleMesh& proxy, const MechanicsModel& model,
                           const Eigen::VectorXd& load_n, const Hold& hold) {
  DeformOptions options;
  options.solver = TissueSolver::fem;
  options.iterations = hold.iterations;
  Deformer deformer(proxy, model, {}, options);
  std::vector<Eigen::Vector3d> forces;
  for (Eigen::Index v = 0; v < load_n.size() / 3; ++v)
    forces.emplace_back(load_n.segment<3>(3 * v));
  deformer.set_load(forces);
  for (int step = 0; step < hold.steps; ++step) deformer.step({});
  Eigen::VectorXd moved(load_n.size());
  for (std::size_t v = 0; v < proxy.vertices.size(); ++v)
    moved.segment<3>(static_cast<Eigen::Index>(3 * v)) =
        deformer.positions()[v] - proxy.vertices[v];
  return moved;
}

constexpr double kNoMove = 1e-6;  // of the largest: the load's patch hangs on anchors

// Of one shape, or of several side by side.
double largest_move(const Eigen::MatrixXd& shapes) {
  return Eigen::Map<const Eigen::Matrix3Xd>(shapes.data(), 3, shapes.size() / 3)
      .colwise()
      .norm()
      .maxCoeff();
}

// Some loads of all, each as strong as presses the linear solution's skin in by `depth_mm`.
std::vector<Eigen::VectorXd> pressing(const MechanicsModel& model, const Eigen::MatrixXd& loads,
                                      double depth_mm) {
  constexpr Eigen::Index kCount = 8;
  const Eigen::MatrixXd shapes = fem_displacements(model, loads);
  std::vector<Eigen::VectorXd> chosen;
  for (Eigen::Index l = 0; l < loads.cols();
       l += std::max<Eigen::Index>(1, loads.cols() / kCount)) {
    const double move = largest_move(shapes.col(l));
    if (move > kNoMove * largest_move(shapes)) chosen.emplace_back(depth_mm / move * loads.col(l));
  }
  return chosen;
}

void promise_converged(const TriangleMesh& proxy, const MechanicsModel& model,
                       const Eigen::MatrixXd& loads, const std::string& name) {
  std::vector<double> early, linear;
  for (const Eigen::VectorXd& load : pressing(model, loads, 10)) {
    const Eigen::VectorXd converged = held_shape(proxy, model, load, {60, 1200});
    const Eigen::VectorXd soon = held_shape(proxy, model, load, {DeformOptions{}.iterations, 120});
    early.push_back((soon - converged).norm() / converged.norm());
  }
  for (const Eigen::VectorXd& load : pressing(model, loads, 0.1)) {
    const Eigen::VectorXd truth = fem_displacements(model, load);
    linear.push_back((held_shape(proxy, model, load, {60, 1200}) - truth).norm() / truth.norm());
  }
  const std::string what = "finite elements, " + name + ": ";
  expect({what + "shape 2 s after a dead load of 10 mm from the converged one, median", "%",
          100 * median(early), 1});
  expect({what + "shape under a dead load of 0.1 mm from linear FEM's, median", "%",
          100 * median(linear), 1});
}

TEST(Statics, OfElementsAndSpringsAreNearLinearOnes) {
  DecimateOptions decimation;
  decimation.faces = 80;
  const TriangleMesh proxy = decimate(OrganPhantom({}).surface(6), decimation).proxy;
  MechanicsOptions options;
  options.fem = true;
  MechanicsModel model = make_mechanics(proxy, options);
  const std::string name = "proxy of 80 faces, " + std::to_string(model.body->tetrahedra.size()) +
                           " tetrahedra, Poisson's ratio " + to_text(options.poisson_ratio);
  const DeadLoads loads = patch_loads(proxy, model.anchors);
  promise_converged(proxy, model, loads.fitted, name);
  const SpringFitReport fit = fit_springs_to_fem(proxy, model);
  const std::string what = "springs fitted to linear FEM, " + name + ": shape under ";
  expect({what + "the dead loads of the fit, median error", "%", 100 * fit.fitted, 10});
  expect({what + "dead loads held out, median error", "%", 100 * fit.held_out, 25});
}

}  // namespace
}  // namespace organbake
