// SPDX-License-Identifier: GPL-3.0-or-later
// Robust weights of depth at a pose, and what it can be trusted with: the sandwich's two halves.
#include "depth/weighed_depth.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "appearance/appearance.h"
#include "organbake/geometry/dense_solve.h"

namespace organbake {
namespace {

using Column7 = Eigen::Matrix<double, 7, 1>;
using Part = std::pair<int, int>;  // row, column

// Parts of the view along its longer side. Their number bounds how well they tell how much slopes
// vary, their size how far errors may reach.
constexpr int kParts = 10;

Eigen::MatrixXd variability(const std::map<Part, Column7>& slopes) {
  constexpr int kReach = 2;  // parts: from there on errors count as independent
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(7, 7);
  for (const auto& [a, slope] : slopes)
    for (int y = 1 - kReach; y < kReach; ++y)
      for (int x = 1 - kReach; x < kReach; ++x) {
        const auto other = slopes.find({a.first + y, a.second + x});
        if (other == slopes.end()) continue;
        const double share =
            (1 - std::abs(y) / double(kReach)) * (1 - std::abs(x) / double(kReach));
        sum += share * slope * other->second.transpose();
      }
  // What was fitted to them took some of their variation away.
  const double parts = static_cast<double>(slopes.size());
  return sum * parts / std::max(1.0, parts - 7);
}

}  // namespace

double CompositeEvidence::magnitude() const {
  Eigen::MatrixXd curvature = information;
  curvature.diagonal() *= 1 + 1e-9;
  const double excess = solve_symmetric(curvature, variability).trace();
  return static_cast<double>(information.rows()) / excess;
}

WeighedDepth weigh_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                         const DepthState& state) {
  constexpr double kCutoff = 3, kLargestNoise = 0.02;
  WeighedDepth weighed;
  weighed.matches = match_depth(surface, depth, state);
  weighed.noise =
      std::min(kLargestNoise, depth_noise(depth, weighed.matches, state, surface.center()));
  weighed.weights.assign(weighed.matches.size(), 0.0);
  const int side = std::max(1, std::max(depth.columns, depth.rows) / kParts);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(7, 7);
  std::map<Part, Column7> slopes;
  for (std::size_t i = 0; i < weighed.matches.size(); ++i) {
    if (weighed.matches[i].kind != DepthMatch::Kind::on) continue;
    const SeenDepth::Point& point = depth.points[i];
    const DepthRow row = depth_row(point, weighed.matches[i], state, surface.center());
    const double off = row.distance / (kCutoff * weighed.noise);
    const double weight = point.trust * robust_weight(off * off) / (weighed.noise * weighed.noise);
    weighed.weights[i] = weight;
    information += weight * row.slope * row.slope.transpose();
    auto& slope =
        slopes.try_emplace({point.row / side, point.column / side}, Column7::Zero()).first->second;
    slope += weight * row.distance * row.slope;
  }
  weighed.evidence = {information, variability(slopes)};
  const double magnitude = weighed.evidence.magnitude();
  weighed.trust = magnitude > 0 ? std::min(1.0, magnitude) : 0;
  return weighed;
}

}  // namespace organbake
