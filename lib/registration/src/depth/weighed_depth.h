// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "depth/depth_alignment.h"

namespace organbake {

// What a composite likelihood says of its parameters: the curvature of its logarithm, and how much
// its slope varies. Where its parts were independent the two would be one.
struct CompositeEvidence {
  Eigen::MatrixXd information, variability;

  // By what the logarithm has to be multiplied so that it tells no more than it knows: the
  // magnitude adjustment of Pauli, Racugno & Ventura 2011.
  double magnitude() const;
};

// The depth at a pose: what it is matched with, what each point weighs, and what that is worth.
struct WeighedDepth {
  std::vector<DepthMatch> matches;
  std::vector<double> weights;  // of squared distances; 0 where nothing matches
  double noise = 0;             // of a distance, share of the point's distance from the camera
  CompositeEvidence evidence;   // by motion (6) and log scale
  double trust = 1;             // its magnitude, at most 1
};

// Neighbouring points err alike: smooth errors of depth are told from how much the slopes of parts
// of the view vary, with those of neighbouring parts correlated (Bartlett's window, Conley 1999).
WeighedDepth weigh_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                         const DepthState& state);

}  // namespace organbake
