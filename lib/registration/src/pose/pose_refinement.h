// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "appearance/appearance.h"
#include "cost_functions/live_prediction.h"
#include "cost_functions/ncc_cost.h"
#include "organbake/core/run_context.h"

namespace organbake {

class LevelProblem;
struct RefineState;

struct RefineOptions {
  Light light;
  Similarity similarity = Similarity::radiance;
  SimilarityWindow window =
      SimilarityWindow::patches;  // on the two finest levels; coarser ones always take the whole
                                  // picture, and so does the finest where one gain fits all patches
  int patch_px = 24;
  bool free_focal = false;
  bool check_focal = true;    // of a finished pose
  int outer_iterations = 4;   // overlap, light and weights anew, per level
  int solver_iterations = 8;  // within each
  // Adds what else is known of the pose to each problem before it is solved.
  std::function<void(const RefineState&, LevelProblem&)> add_terms;
};

// Where the solver stands: pose, light, focal scale, and what the last overlap said of them.
struct RefineState {
  SolverState solver;
  Appearance appearance;
  double correlation = -1;  // R over the last overlap, weighted
  bool usable = false;      // the organ is in the picture, and the photograph is not constant there
};

// The basis for a surface's pose: falloff 1 at the organ's centre.
ShadingBasis basis_for(const RefineOptions& options, const ObjectPose& pose);

// Whether a pose has the surface's centre well before the camera, and is finite.
bool in_front(const RegisteredSurface& surface, const ObjectPose& pose);

// Climbs R coarse to fine, over levels first … last of a pyramid (finest first in memory, so
// first ≥ last), from the state's pose; the state is left where it was when the organ is out of the
// picture.
void refine(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid, int first,
            int last, const RefineOptions& options, RefineState& state, const RunContext& context);

// What a level says of a state whose pose stands: its light, the appearance and R.
void appraise(const RegisteredSurface& surface, const PhotoLevel& level,
              const RefineOptions& options, RefineState& state);

// (JᵀJ) of r by the motion (and ln f last when asked) and its parts by patch, of the state's R on a
// level: what the covariance is made of.
struct Curvature {
  Eigen::MatrixXd information;                // 6 × 6 or 7 × 7, light marginalised
  std::vector<Eigen::VectorXd> patch_slopes;  // Jᵀr of each patch
  std::size_t pixels = 0;
};
Curvature curvature(const RegisteredSurface& surface, const PhotoLevel& level,
                    const RefineOptions& options, const RefineState& state);

}  // namespace organbake
