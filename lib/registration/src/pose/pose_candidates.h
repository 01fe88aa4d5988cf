// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "appearance/photo_pyramid.h"
#include "pose/pose_refinement.h"

namespace organbake {

// What stands out from the background that the picture's border shows.
struct Foreground {
  double area_px = 0;
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
};

// The share of the photograph's variance that lamp and background explain over all that counts: R²
// at the best gain, offset and background level. What is far off costs no more than so much, so
// that an instrument draws no pose its way. Negative when the lamp would have to darken.
double explained(const PhotoLevel& level, const Prediction& prediction);

// Poses to try on one level of a photograph. Where the organ stands out from a plain background,
// its area and centre say distance and place. Threads across poses; ordered, so repeatable.
class PoseCandidates {
 public:
  // All outlive the candidates.
  PoseCandidates(const RegisteredSurface& surface, const PhotoLevel& level,
                 const RefineOptions& options, const RunContext& context);

  // From directions all round, in all rolls; where the organ does not stand out, at a grid of
  // places and sizes.
  std::vector<ObjectPose> all_round() const;
  // Turned from a start by up to 0.5 rad about axes all round; where the start puts the organ, and
  // where it stands out when it does.
  std::vector<ObjectPose> near(const ObjectPose& start) const;
  // What each explains, in their order.
  std::vector<double> scores(const std::vector<ObjectPose>& poses) const;

 private:
  // A rotation, and the area and centre that its picture has at the usual distance.
  struct View {
    Eigen::Quaterniond rotation;
    double area_px = 0;
    Eigen::Vector2d offset = Eigen::Vector2d::Zero();  // of the picture's centre from the organ's,
                                                       // normalised
  };

  Prediction picture(const PhotoLevel& level, const ObjectPose& pose) const;
  double usual_distance() const;
  View view(const Eigen::Quaterniond& rotation) const;
  std::vector<View> views(const std::vector<Eigen::Quaterniond>& rotations) const;
  std::vector<ObjectPose> around(int direction_count, int rolls,
                                 const std::vector<Foreground>& places) const;
  ObjectPose placed(const View& view, double roll, const Foreground& place) const;

  const RegisteredSurface& surface_;
  const PhotoLevel& level_;
  const RefineOptions& options_;
  const RunContext& context_;
  PhotoLevel centered_;  // its lens and rays with the axis in the middle; no photograph
  std::optional<Foreground> seen_;
};

}  // namespace organbake
