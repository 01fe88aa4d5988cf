// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "organ_frame.h"
#include "organbake/core/run_context.h"
#include "organbake/viewpoints/placement.h"
#include "organbake/viewpoints/sight.h"
#include "spread_directions.h"

namespace organbake {

// As many cameras as a coverage may take.
inline constexpr std::size_t kMostCoverCameras = 256;

// What cameras are chosen by: an organ, the region that its viewers are in, where cameras may stand
// for them, and what they see from there, all at one common distance. Cameras are named by their
// directions (organ's centre → eye, unit).
class CoverScene {
 public:
  using Directions = std::vector<Eigen::Vector3d>;

  // The faces look outward; options.coverage is given. All outlive the scene.
  CoverScene(const TriangleMesh& surface, const OrganFrame& organ, const PlacementOptions& options,
             const RunContext& context);

  const TriangleMesh& surface() const { return surface_; }
  const CoverageGoal& goal() const { return *options_.coverage; }
  const RunContext& context() const { return context_; }

  // Evenly over the region: where viewers may be.
  Directions views(int count) const;
  // Where cameras may stand: so many evenly over the region and a ring along its rim (narrow dents
  // show themselves there only), and half as many beyond it.
  Directions stands(int count) const;
  bool may_stand(const Eigen::Vector3d& direction) const;
  // Between neighbours of so many cameras that share the room they have evenly.
  double spacing_rad(std::size_t count) const;
  Eigen::Vector3d eye_mm(const Eigen::Vector3d& direction) const;

  SurfaceSamples samples(std::size_t count, std::uint64_t seed) const;
  // Seen well, as CoverageGoal says: by each camera, and from anywhere in the region.
  std::vector<SampleBits> seen_well(const Directions& cameras, const SurfaceSamples& samples,
                                    const SampleBits* among) const;
  SampleBits reachable(const SurfaceSamples& samples) const;
  // Of the samples `among`, by number: those that fewer than goal().overlap of the cameras see
  // well.
  std::vector<std::uint32_t> missed(const Directions& cameras, const SurfaceSamples& samples,
                                    const SampleBits& among) const;
  // Seen at any angle.
  std::vector<SampleBits> visible(const Directions& cameras, const SurfaceSamples& samples) const;

  // The cameras, farther off where the organ would not fit their maps.
  Placement placed(const Directions& cameras) const;

 private:
  std::vector<Eye> eyes(const Directions& directions, double texel_mm) const;
  SightLimits well() const { return {kLeastSeenCosine, goal().texel_mm}; }

  const TriangleMesh& surface_;
  const OrganFrame& organ_;
  const PlacementOptions& options_;
  const RunContext& context_;
  ViewingCone region_, stand_;
  Sight sight_;
  double distance_mm_;
};

}  // namespace organbake
