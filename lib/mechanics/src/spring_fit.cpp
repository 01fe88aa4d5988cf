// SPDX-License-Identifier: GPL-3.0-or-later
// Stiffnesses of springs fitted to finite elements by Levenberg–Marquardt over their logarithms,
// which keeps them positive. Errors count by their logarithm: squares would buy a few hopeless
// loads' fit with everyone's.
#include "organbake/mechanics/spring_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/median.h"
#include "organbake/mechanics/dead_loads.h"
#include "organbake/mechanics/linear_statics.h"

namespace organbake {
namespace {

constexpr std::size_t kMostSprings = 4000;
constexpr int kMostIterations = 200;
constexpr double kLongestStep = 1;      // of a logarithm
constexpr double kLargestScale = 1e4;   // and 1/10,000: no spring leaves the range of the others
constexpr double kTowardsStart = 1e-8;  // weight of leaving a spring as it is
constexpr double kEnough = 1e-5;  // gain (of a logarithm) below which more iterations are idle
// A load's error e counts as ln √(e² + this²), so that the geometric mean is made small: squares
// would buy a few hopeless loads' fit with everyone's.
constexpr double kRounded = 0.02;
constexpr double kNoMove = 1e-6;  // of what the softest load moves
constexpr double kWeak = 0.5;     // of the mean stiffness: what added springs start with

class Fit {
 public:
  // Loads that move nothing of the goal (all of their patch hangs on anchors) have no relative
  // error, and are left out.
  Fit(const LinearSprings& springs, const Eigen::MatrixXd& loads, const Eigen::MatrixXd& goal)
      : springs_(springs) {
    const Eigen::MatrixXd all_goals = springs.free_rows(goal), all_loads = springs.free_rows(loads);
    const Eigen::RowVectorXd sizes = all_goals.colwise().norm();
    std::vector<Eigen::Index> moving;
    for (Eigen::Index l = 0; l < sizes.size(); ++l) {
      if (sizes[l] > kNoMove * sizes.maxCoeff()) moving.push_back(l);
    }
    if (moving.empty()) throw BadDataError("no load moves the tetrahedra: too much is anchored");
    loads_ = all_loads(Eigen::all, moving);
    goal_ = all_goals(Eigen::all, moving);
    inverse_size_ = goal_.colwise().norm().cwiseInverse();
  }

  // Of each load, relative to the goal's size.
  std::vector<double> errors(const Eigen::VectorXd& logs) const {
    const Eigen::MatrixXd miss = springs_.compliance(logs.array().exp()) * loads_ - goal_;
    const Eigen::RowVectorXd relative = miss.colwise().norm().cwiseProduct(inverse_size_);
    return {relative.data(), relative.data() + relative.size()};
  }
  double cost(const Eigen::VectorXd& logs) const {
    double sum = 0;
    for (const double error : errors(logs)) sum += std::log(std::hypot(error, kRounded));
    return sum / static_cast<double>(loads_.cols()) + kTowardsStart * logs.squaredNorm() / 2;
  }
  // The cost's slope, and the Gauss–Newton matrix. With C the compliance, G the springs'
  // stretches and e = Gᵀu, ∂u/∂log kᵢ = −C gᵢ kᵢ eᵢ; summed over the loads the matrix is a product
  // entry by entry, (GᵀC²G) ∘ (Σ e eᵀ), and no Jacobian is formed.
  void linearise(const Eigen::VectorXd& logs, Eigen::VectorXd& slope,
                 Eigen::MatrixXd& matrix) const {
    const Eigen::VectorXd scales = logs.array().exp();
    const Eigen::MatrixXd compliance = springs_.compliance(scales);
    const Eigen::VectorXd stiffness = springs_.stiffness_n_per_mm().cwiseProduct(scales);
    const Eigen::MatrixXd moved = compliance * loads_;
    const Eigen::RowVectorXd shares = roots_of_shares(moved);
    const Eigen::MatrixXd miss = (moved - goal_) * shares.asDiagonal();
    const Eigen::MatrixXd pulls =
        stiffness.asDiagonal() * (springs_.stretch().transpose() * moved) * shares.asDiagonal();
    const Eigen::MatrixXd answers = compliance * springs_.stretch();
    slope =
        -(answers.transpose() * miss).cwiseProduct(pulls).rowwise().sum() + kTowardsStart * logs;
    matrix = (answers.transpose() * answers).cwiseProduct(pulls * pulls.transpose());
    matrix.diagonal().array() += kTowardsStart;
  }

 private:
  // By whose squares the squared misses (mm²) count.
  Eigen::RowVectorXd roots_of_shares(const Eigen::MatrixXd& moved) const {
    const Eigen::ArrayXXd relative = (moved - goal_).colwise().norm().cwiseProduct(inverse_size_);
    const Eigen::ArrayXXd squares = relative.square() + kRounded * kRounded;
    const auto count = static_cast<double>(loads_.cols());
    return (inverse_size_.array() / (count * squares).sqrt()).matrix();
  }

  const LinearSprings& springs_;
  Eigen::MatrixXd loads_, goal_;
  Eigen::RowVectorXd inverse_size_;
};

Eigen::VectorXd bounded(const Eigen::VectorXd& logs) {
  const double most = std::log(kLargestScale);
  return logs.cwiseMax(-most).cwiseMin(most);
}

// Levenberg–Marquardt.
int minimise(const Fit& fit, Eigen::VectorXd& logs, const RunContext& context) {
  double cost = fit.cost(logs), damping = 1e-3;
  Eigen::VectorXd slope;
  Eigen::MatrixXd matrix;
  for (int iteration = 1; iteration <= kMostIterations; ++iteration) {
    context.throw_if_cancelled();
    fit.linearise(logs, slope, matrix);
    for (;; damping *= 4) {
      if (damping > 1e6) return iteration;
      Eigen::MatrixXd damped = matrix;
      damped.diagonal() *= 1 + damping;
      const Eigen::VectorXd step =
          -damped.llt().solve(slope).cwiseMax(-kLongestStep).cwiseMin(kLongestStep);
      const Eigen::VectorXd next = bounded(logs + step);
      const double next_cost = fit.cost(next);
      if (!(next_cost < cost)) continue;
      const bool enough = cost - next_cost < kEnough;
      logs = next;
      cost = next_cost;
      damping /= 4;
      if (enough) return iteration;
      break;
    }
  }
  return kMostIterations;
}

// Springs between all vertices that have any, if that many can be fitted: elements act across the
// body in all directions, surface springs and struts along few. Damped like those that are there.
void add_missing_springs(const TriangleMesh& proxy, MechanicsModel& model) {
  std::set<std::uint32_t> used;
  std::set<std::pair<std::uint32_t, std::uint32_t>> joined;
  double stiffness = 0, damping_per_root = 0;
  for (const Spring& s : model.springs) {
    used.insert({s.a, s.b});
    joined.insert(std::minmax(s.a, s.b));
    stiffness += s.stiffness_n_per_mm;
    damping_per_root += s.damping_n_s_per_mm / std::sqrt(s.stiffness_n_per_mm);
  }
  const auto count = static_cast<double>(model.springs.size());
  if (used.size() * (used.size() - 1) / 2 > kMostSprings) return;
  const double weak = kWeak * stiffness / count;
  const auto is_anchor = [&](std::uint32_t v) {
    return std::binary_search(model.anchors.begin(), model.anchors.end(), v);
  };
  for (const std::uint32_t a : used) {
    for (const std::uint32_t b : used) {
      const double length = (proxy.vertices[a] - proxy.vertices[b]).norm();
      if (b <= a || !(length > 0) || joined.contains({a, b})) continue;
      if (is_anchor(a) && is_anchor(b)) continue;  // it would move nothing
      model.springs.push_back({a, b, length, weak, damping_per_root / count * std::sqrt(weak)});
    }
  }
}

}  // namespace

double spring_error(const TriangleMesh& proxy, const MechanicsModel& model,
                    const Eigen::MatrixXd& loads_n) {
  const LinearSprings springs(proxy, model);
  const Fit fit(springs, loads_n, fem_displacements(model, loads_n));
  return median(fit.errors(Eigen::VectorXd::Zero(springs.stretch().cols())));
}

SpringFitReport fit_springs_to_fem(const TriangleMesh& proxy, MechanicsModel& model,
                                   const RunContext& context) {
  if (model.springs.size() > kMostSprings) {
    throw UsageError("fit_to_fem: " + std::to_string(model.springs.size()) +
                     " springs are more than " + std::to_string(kMostSprings) +
                     "; take a proxy of fewer faces");
  }
  const DeadLoads loads = patch_loads(proxy, model.anchors);
  SpringFitReport report;
  report.fitted_before = spring_error(proxy, model, loads.fitted);
  report.held_out_before = spring_error(proxy, model, loads.held_out);
  add_missing_springs(proxy, model);
  const LinearSprings springs(proxy, model);
  const Fit fit(springs, loads.fitted, fem_displacements(model, loads.fitted));
  Eigen::VectorXd logs = Eigen::VectorXd::Zero(springs.stretch().cols());
  report.iterations = minimise(fit, logs, context);
  for (std::size_t i = 0; i < springs.springs().size(); ++i) {
    Spring& spring = model.springs[springs.springs()[i]];
    spring.stiffness_n_per_mm *= std::exp(logs[static_cast<Eigen::Index>(i)]);
    spring.damping_n_s_per_mm *= std::exp(logs[static_cast<Eigen::Index>(i)] / 2);
  }
  report.fitted = spring_error(proxy, model, loads.fitted);
  report.held_out = spring_error(proxy, model, loads.held_out);
  return report;
}

}  // namespace organbake
