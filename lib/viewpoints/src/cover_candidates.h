// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "choose_cover.h"
#include "sample_pool.h"

namespace organbake {

// Where cameras might stand, and what each would see of a pool's working samples.
class CoverCandidates {
 public:
  using Directions = CoverScene::Directions;

  // Both outlive the candidates.
  CoverCandidates(const CoverScene& scene, const SamplePool& pool, Directions directions);

  std::size_t size() const { return directions_.size(); }
  const CandidateVisibility& seen() const { return seen_; }
  Directions directions_of(const ChosenCover& cover) const;
  // Working samples that so many candidates see.
  std::size_t seen_by(int times) const;

  // At all working samples, where they are other ones; or at those that joined them.
  void look();
  void look_at_joined(const SurfaceSamples& joined);

  // What lies deep shows itself from a few directions only, and even candidates may pass them by:
  // of a finer lattice those join that together show each such sample often enough.
  void add_for_the_hidden();
  // Six more round each chosen one.
  void add_round(const ChosenCover& cover, double reach_rad);

 private:
  SurfaceSamples seen_by_fewer_than(int times) const;
  void append(const Directions& given);

  const CoverScene& scene_;
  const SamplePool& pool_;
  Directions directions_;
  CandidateVisibility seen_;
};

}  // namespace organbake
