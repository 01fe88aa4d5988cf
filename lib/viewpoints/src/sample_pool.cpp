// SPDX-License-Identifier: GPL-3.0-or-later
// Samples that cameras are chosen by: on folded surfaces those that are hardest to see, for the
// rest is seen by whatever shows these.
#include "sample_pool.h"

#include <algorithm>

namespace organbake {
namespace {

constexpr std::size_t kJudges = 96;
// Samples that so few of the judges see lie deep. Where these are more than such a share of what
// the goal lets go, it is them who decide.
constexpr int kDeep = 3;
constexpr double kFolded = 0.5;
// Times as many samples, and working ones of them, where it is so.
constexpr std::size_t kPerWorking = 24, kWhereFolded = 3;
constexpr std::size_t kFiner = 4;

CoverScene::Directions some_of(const CoverScene::Directions& candidates) {
  CoverScene::Directions some;
  for (std::size_t k = 0; k < kJudges; ++k)
    some.push_back(candidates[k * candidates.size() / kJudges]);
  return some;
}

}  // namespace

SamplePool::SamplePool(const CoverScene& scene, const Directions& candidates, std::size_t working,
                       std::uint64_t seed)
    : scene_(scene), judges_(some_of(candidates)), seed_(seed) {
  draw(working, seed);
  hardest_ = judged();
  const auto deep = std::count_if(hardest_.begin(), hardest_.end(),
                                  [](const Eased& sample) { return sample.first <= kDeep; });
  folded_ = static_cast<double>(deep) >
            kFolded * (1 - scene.goal().share) * static_cast<double>(hardest_.size());
  if (folded_) {
    draw(kPerWorking * working, seed);
    hardest_ = judged();
    hardest_.resize(std::min(hardest_.size(), kWhereFolded * working));
  }
  work_with_hardest();
}

void SamplePool::refine() {
  const int hard = hardest_.empty() ? 0 : hardest_.back().first;
  const std::vector<bool> is_hard = hard_faces();
  const SurfaceSamples coarse = std::move(samples_);
  const SampleBits coarse_reachable = std::move(reachable_);

  samples_ = {};
  const SurfaceSamples fine = scene_.samples(kFiner * coarse.size(), seed_ + 1);
  for (std::size_t i = 0; i < fine.size(); ++i) {
    if (is_hard[fine.faces[i]]) append_sample(fine, i, samples_);
  }
  reachable_ = scene_.reachable(samples_);
  stands_for_.assign(samples_.size(), 1);
  is_working_ = SampleBits(samples_.size());
  working_samples_ = {};
  hardest_ = judged();
  std::erase_if(hardest_, [hard](const Eased& sample) { return sample.first > hard; });

  for (std::size_t i = 0; i < coarse.size(); ++i) {
    if (is_hard[coarse.faces[i]] || !coarse_reachable.test(i)) continue;
    append_sample(coarse, i, samples_);
    stands_for_.push_back(kFiner);
  }
  SampleBits elsewhere(samples_.size() - reachable_.size());
  for (std::size_t i = 0; i < elsewhere.size(); ++i) elsewhere.set(i);
  is_working_.append(SampleBits(elsewhere.size()));
  reachable_.append(elsewhere);
  work_with_hardest();
}

void SamplePool::draw(std::size_t count, std::uint64_t seed) {
  samples_ = scene_.samples(count, seed);
  stands_for_.assign(count, 1);
  reachable_ = scene_.reachable(samples_);
  is_working_ = SampleBits(count);
}

// Hardest first.
std::vector<SamplePool::Eased> SamplePool::judged() const {
  const std::vector<SampleBits> seen = scene_.seen_well(judges_, samples_, &reachable_);
  std::vector<Eased> by_ease;
  for (std::uint32_t i = 0; i < samples_.size(); ++i) {
    if (reachable_.test(i)) by_ease.push_back({times_in(seen, i, kJudges), i});
  }
  std::sort(by_ease.begin(), by_ease.end());
  return by_ease;
}

// Those of hard samples and their neighbours.
std::vector<bool> SamplePool::hard_faces() const {
  const std::vector<Face>& faces = scene_.surface().faces;
  std::vector<bool> at_vertex(scene_.surface().vertices.size(), false), is_hard(faces.size());
  for (const auto& [times, sample] : hardest_) {
    for (const std::uint32_t v : faces[samples_.faces[sample]]) at_vertex[v] = true;
  }
  for (std::size_t f = 0; f < faces.size(); ++f) {
    is_hard[f] = std::any_of(faces[f].begin(), faces[f].end(),
                             [&](std::uint32_t v) { return at_vertex[v]; });
  }
  return is_hard;
}

void SamplePool::work_with_hardest() {
  std::vector<std::uint32_t> samples;
  for (const auto& [times, sample] : hardest_) samples.push_back(sample);
  std::sort(samples.begin(), samples.end());  // neighbours on the surface stay neighbours
  join(samples);
}

std::size_t SamplePool::reachable() const {
  std::size_t sum = 0;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    if (reachable_.test(i)) sum += stands_for_[i];
  }
  return sum;
}

std::vector<std::uint32_t> SamplePool::missed_by(const Directions& cameras) const {
  std::vector<std::uint32_t> missed;
  for (const std::uint32_t i : scene_.missed(cameras, samples_, reachable_))
    missed.insert(missed.end(), stands_for_[i], i);
  return missed;
}

SurfaceSamples SamplePool::join(const std::vector<std::uint32_t>& samples) {
  SurfaceSamples joined;
  SampleBits joins(is_working_.size());
  for (const std::uint32_t i : samples) {
    if (is_working_.test(i)) continue;
    joins.set(i);
    append_sample(samples_, i, working_samples_);
    append_sample(samples_, i, joined);
  }
  is_working_ |= joins;
  return joined;
}

}  // namespace organbake
