// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "organ.h"
#include "organbake/core/run_context.h"
#include "organbake/viewpoints/placement.h"
#include "sight.h"

namespace organbake {

// What a set of cameras must do: at least `samples` samples seen by at least `overlap` of them.
struct CoverGoal {
  std::size_t samples = 0;
  int overlap = 2;
};

// Candidates, each by the samples that it sees.
using CandidateVisibility = std::vector<SampleBits>;

struct ChosenCover {
  std::vector<std::uint32_t> chosen;  // candidates, increasing
  std::size_t covered = 0;            // samples seen by at least goal.overlap of them
};

// Adds to a start always what gains most next, up to `most` candidates; fewer samples than the goal
// when they don't do. Deterministic.
[[nodiscard]] ChosenCover greedy_cover(const CandidateVisibility& seen, ChosenCover start,
                                       const CoverGoal& goal, std::size_t most);

struct Annealing {
  std::size_t moves = 1'000'000;
  // In units of one chosen candidate's share of what the goal lets go: a move by which so much more
  // is lacking is accepted one time in e, at first and in the end.
  double hot = 0.25, cold = 0.05;
};
// The fewest candidates found that reach a goal, by simulated annealing (Kirkpatrick, Gelatt and
// Vecchi 1983): one chosen candidate goes and one that sees a lacking sample comes, worse choices
// accepted less and less often; where the goal is reached, the one that is missed least goes for
// good. Where it is not, the start's number of candidates with the most samples covered.
// Deterministic. Throws CancelledError.
[[nodiscard]] ChosenCover annealed_cover(const CandidateVisibility& seen, const ChosenCover& start,
                                         const CoverGoal& goal, const Annealing& annealing,
                                         const RunContext& context = {});

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

// Samples of what is reachable, and the working ones among them that cameras are chosen by: all, on
// a smooth surface. On a deeply folded one a few places decide, and each needs many samples: there
// are many times as many, and those work that are hardest to see. The rest is seen often enough by
// whatever cameras show these; what is not, joins.
class SamplePool {
 public:
  using Directions = CoverScene::Directions;

  // Some of the candidates judge how hard a sample is to see.
  SamplePool(const CoverScene& scene, const Directions& candidates, std::size_t working,
             std::uint64_t seed);

  bool folded() const { return folded_; }
  // Several times as many samples where some are hard to see: cameras that were chosen by few have
  // been made for just these. Elsewhere one sample stands for as many.
  void refine();

  std::size_t reachable() const;
  const SurfaceSamples& working() const { return working_samples_; }

  // Reachable ones that the cameras miss, by number; as often as the surface that they stand for.
  std::vector<std::uint32_t> missed_by(const Directions& cameras) const;
  // Makes samples working ones; returns those that were not yet, the last of the working ones now.
  SurfaceSamples join(const std::vector<std::uint32_t>& samples);

 private:
  using Eased = std::pair<int, std::uint32_t>;  // judges that see it, sample
  void draw(std::size_t count, std::uint64_t seed);
  std::vector<Eased> judged() const;
  std::vector<bool> hard_faces() const;
  void work_with_hardest();

  const CoverScene& scene_;
  Directions judges_;
  std::uint64_t seed_;
  SurfaceSamples samples_;
  std::vector<std::uint32_t> stands_for_;  // so many
  SampleBits reachable_, is_working_;
  std::vector<Eased> hardest_;  // that the pool began to work with
  SurfaceSamples working_samples_;
  bool folded_ = false;
};

// The fewest cameras found that reach options.coverage, chosen among even directions over the
// viewing region and a little beyond it (kBeyondRegion_rad) at one common distance, then moved
// between them; where views over the VPM would still miss more than 0.1 % of what they show,
// on average, cameras are added at the worst of them. Reached is what independent samples say. When
// the goal is out of reach (or of 256 cameras) the best is kept, with a warning. Throws
// BadDataError when no view of the region shows anything.
Placement cover_with_cameras(const TriangleMesh& surface, const OrganFrame& organ,
                             const PlacementOptions& options, const RunContext& context);

}  // namespace organbake
