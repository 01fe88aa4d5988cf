// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "cover_scene.h"

namespace organbake {

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

}  // namespace organbake
