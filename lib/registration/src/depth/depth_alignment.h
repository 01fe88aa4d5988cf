// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/registration/register_photo.h"
#include "organbake/registration/registered_surface.h"

namespace organbake {

// Where an alignment stands: the surface's pose, and by how much the depth's lengths are too short.
struct DepthState {
  ObjectPose pose;
  double log_scale = 0;  // mm = depth's length × exp(this)
};

// What is expected of the scale: of metric depth its bias, of relative depth next to nothing.
struct ScalePrior {
  double log_mean = 0, log_sd = 0.01;
};

// One point of the depth against the surface. Distances are shares of the point's own distance from
// the camera, as depth's errors are.
struct DepthMatch {
  enum class Kind {
    on,        // the surface's nearest place can be what is seen
    beyond,    // the surface is cut there, or lies far off: what is seen is something else
    in_front,  // the surface would hide what is seen
  };
  Kind kind = Kind::beyond;
  Eigen::Vector3d place_world = Eigen::Vector3d::Zero(), normal_world = Eigen::Vector3d::Zero();
  std::uint32_t nearest_face = kNoHit;
};

// The points' nearest places on the surface; `stride` takes every so-manieth point. Matches of a
// state near this one, of the same points, make the search quicker and change nothing else.
std::vector<DepthMatch> match_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                                    const DepthState& state, std::size_t stride = 1,
                                    const std::vector<DepthMatch>& before = {});

// A point's distance to the plane of its match over its distance from the camera, and the slopes of
// that by the surface's motion and by log_scale. Scale makes no distance smaller (Umeyama's
// similarity would shrink the depth to a point): both lengths carry it.
struct DepthRow {
  double distance = 0;
  Eigen::Matrix<double, 7, 1> slope = Eigen::Matrix<double, 7, 1>::Zero();
};
DepthRow depth_row(const SeenDepth::Point& point, const DepthMatch& match, const DepthState& state,
                   const Eigen::Vector3d& center_world_mm);

// Robust spread of the distances of what matches.
double depth_noise(const SeenDepth& depth, const std::vector<DepthMatch>& matches,
                   const DepthState& state, const Eigen::Vector3d& center_world_mm);

struct AlignOptions {
  std::size_t stride = 1;
  int iterations = 10;
  double first_reach = 0.1, last_reach = 0.02;  // shares of the distance: where points lose weight
};
// Point-to-plane alignment (Chen & Medioni 1992) with a robust weight (Geman & McClure) whose reach
// narrows. Moves `state`; the mean cost of all points, 0…1, each either on the surface, by its
// distance, or not. Costs of one depth, stride and reach compare.
double align_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                   const ScalePrior& prior, const AlignOptions& options, DepthState& state);

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

struct FoundByDepth {
  DepthState state;
  ScalePrior prior;
  double cost = 2;
  // By what share less the pose costs than the best one elsewhere; 1 without one.
  double runner_up_margin = 1;
};

// The pose of the surface in a photograph whose depth is known, near a start that is up to about 35
// mm and 20° off: alignments from places all round the start by few of the points, of which the
// best are followed with more. Threads across starts; ordered and seeded, so repeatable.
FoundByDepth search_by_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                             const ObjectPose& start, const RunContext& context);

// The pose of a photograph that came with depth, near `start`: by depth alone first, then both in
// one problem, each with the weight that its own scatter says it has.
RegisteredPhoto register_with_depth(const RegisteredSurface& surface, const PhotoToRegister& photo,
                                    const RigidTransform& start, const RegistrationOptions& options,
                                    const RunContext& context);

}  // namespace organbake
