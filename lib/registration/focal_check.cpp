// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/focal_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "registration/sandwich.h"

namespace organbake {

FocalCheck check_focal(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                       RefineOptions options, RefineState state, const RunContext& context) {
  constexpr int kEnough = 160;  // pixels: a wrong lens shows here, too
  options.free_focal = true;
  options.form = Form::whole;
  options.patch_px = 8;
  int level = static_cast<int>(pyramid.size()) - 1;
  while (level > 0 && pyramid[level].intrinsics.width < kEnough) --level;
  refine(surface, pyramid, level, level, options, state, context);
  FocalCheck check{0, std::numeric_limits<double>::infinity()};
  if (!state.usable) return check;
  const Eigen::MatrixXd spread =
      sandwich_covariance(curvature(surface, pyramid[level], options, state));
  if (spread.rows() != 7 || !spread.allFinite()) return check;
  return {state.solver.log_focal, std::sqrt(std::max(0.0, spread(6, 6)))};
}

}  // namespace organbake
