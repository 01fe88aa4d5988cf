// SPDX-License-Identifier: Apache-2.0
#include "solver/make_tissue.h"

#include "body/fem_body.h"
#include "body/mechanics_checks.h"
#include "solver/spring_network.h"

namespace organbake::deform {

std::unique_ptr<const Tissue> make_tissue(const DeformBodies& bodies,
                                          const DeformOptions& options) {
  if (options.solver == TissueSolver::fem) {
    return std::make_unique<FemBody>(bodies, options.time_step_s);
  }
  return std::make_unique<SpringNetwork>(bodies, options.time_step_s);
}

std::vector<double> kept_volumes(const DeformBodies& bodies, const DeformOptions& options) {
  std::vector<double> kept;
  for (const DeformBody& body : bodies) {
    kept.push_back(options.solver == TissueSolver::fem ? 0 : body.mechanics.volume_stiffness);
  }
  return kept;
}

const DeformBodies& checked_skins(const DeformBodies& bodies) {
  for (const DeformBody& body : bodies) {
    if (body.skin) {
      check_smooth_skin(*body.skin, body.proxy, "smooth skin");
    } else {
      check_base_fits(body.proxy, body.base);
    }
  }
  return bodies;
}

}  // namespace organbake::deform
