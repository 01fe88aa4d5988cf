// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "viewpoints/cover_scene.h"

namespace organbake {

// Samples of what is reachable, and the working ones among them that cameras are chosen by: all, on
// a smooth surface. On a deeply folded one a few places decide, and each needs many samples: there
// are many times as many, and those work that are hardest to see. The rest is seen often enough by
// whatever cameras show these; what is not, joins.
class SamplePool {
 public:
  // Some of the candidates judge how hard a sample is to see.
  SamplePool(const CoverScene& scene, const CoverScene::Directions& candidates, std::size_t working,
             std::uint64_t seed);

  std::size_t reachable() const { return reachable_.count(); }
  bool folded() const { return folded_; }
  const SurfaceSamples& working() const { return working_samples_; }

  // Those that fewer than `overlap` of the cameras see, by number.
  std::vector<std::uint32_t> missed_by(const CoverScene::Directions& cameras, int overlap) const;
  // Makes samples working ones; false when all of them are already.
  bool join(const std::vector<std::uint32_t>& samples);

 private:
  using Eased = std::pair<int, std::uint32_t>;  // judges that see it, sample
  void draw(std::size_t count, std::uint64_t seed);
  std::vector<Eased> judged() const;

  const CoverScene& scene_;
  CoverScene::Directions judges_;
  SurfaceSamples samples_;
  SampleBits reachable_, is_working_;
  SurfaceSamples working_samples_;
  bool folded_ = false;
};

}  // namespace organbake
