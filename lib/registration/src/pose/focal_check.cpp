// SPDX-License-Identifier: GPL-3.0-or-later
#include "pose/pose_quality.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace organbake {

namespace {

// A light with freedom enough that what the lamp really does is not laid to the lens.
LightModel freer(LightModel model) {
  return model == LightModel::camera      ? LightModel::beam
         : model == LightModel::direction ? LightModel::estimated
                                          : model;
}

}  // namespace

FocalCheck check_focal(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                       RefineOptions options, const RefineState& state, const RunContext& context) {
  constexpr int kEnough = 160;  // pixels: a wrong lens shows here, too
  // Under a light from aside the way from a wrong lens to the right one may lead uphill.
  constexpr double kStarts[] = {0, 0.15, -0.15};
  options.free_focal = true;
  options.form = Form::whole;
  options.patch_px = 8;
  options.light.model = freer(options.light.model);
  int level = static_cast<int>(pyramid.size()) - 1;
  while (level > 0 && pyramid[level].intrinsics.width < kEnough) --level;
  RefineState best;
  for (const double start : kStarts) {
    RefineState tried;
    tried.solver.pose = state.solver.pose;
    tried.solver.log_focal = start;
    refine(surface, pyramid, level, level, options, tried, context);
    if (tried.usable && (!best.usable || tried.correlation > best.correlation)) best = tried;
  }
  FocalCheck check{0, std::numeric_limits<double>::infinity()};
  if (!best.usable) return check;
  const Eigen::MatrixXd spread =
      sandwich_covariance(curvature(surface, pyramid[level], options, best));
  if (spread.rows() != 7 || !spread.allFinite()) return check;
  return {best.solver.log_focal, std::sqrt(std::max(0.0, spread(6, 6)))};
}

}  // namespace organbake
