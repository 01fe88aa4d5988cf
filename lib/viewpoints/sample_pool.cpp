// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints/sample_pool.h"

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

CoverScene::Directions some_of(const CoverScene::Directions& candidates) {
  CoverScene::Directions some;
  for (std::size_t k = 0; k < kJudges; ++k)
    some.push_back(candidates[k * candidates.size() / kJudges]);
  return some;
}

SurfaceSamples picked(const SurfaceSamples& from, const SampleBits& which) {
  SurfaceSamples some;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!which.test(i)) continue;
    some.faces.push_back(from.faces[i]);
    some.weights.push_back(from.weights[i]);
    some.points.push_back(from.points[i]);
    some.normals.push_back(from.normals[i]);
  }
  return some;
}

}  // namespace

SamplePool::SamplePool(const CoverScene& scene, const CoverScene::Directions& candidates,
                       std::size_t working, std::uint64_t seed)
    : scene_(scene), judges_(some_of(candidates)) {
  draw(working, seed);
  std::vector<Eased> by_ease = judged();
  const auto deep = std::count_if(by_ease.begin(), by_ease.end(),
                                  [](const Eased& sample) { return sample.first <= kDeep; });
  folded_ = static_cast<double>(deep) >
            kFolded * (1 - scene.goal().share) * static_cast<double>(by_ease.size());
  if (folded_) {
    draw(kPerWorking * working, seed);
    by_ease = judged();
    std::sort(by_ease.begin(), by_ease.end());
    by_ease.resize(std::min(by_ease.size(), kWhereFolded * working));
  }
  std::vector<std::uint32_t> chosen;
  for (const auto& [times, sample] : by_ease) chosen.push_back(sample);
  join(chosen);
}

void SamplePool::draw(std::size_t count, std::uint64_t seed) {
  samples_ = scene_.samples(count, seed);
  reachable_ = scene_.reachable(samples_);
  is_working_ = SampleBits(count);
}

std::vector<SamplePool::Eased> SamplePool::judged() const {
  const std::vector<SampleBits> seen = scene_.seen_well(judges_, samples_, &reachable_);
  std::vector<Eased> by_ease;
  for (std::uint32_t i = 0; i < samples_.size(); ++i) {
    if (reachable_.test(i)) by_ease.push_back({times_in(seen, i, kJudges), i});
  }
  return by_ease;
}

std::vector<std::uint32_t> SamplePool::missed_by(const CoverScene::Directions& cameras,
                                                 int overlap) const {
  const std::vector<SampleBits> seen = scene_.seen_well(cameras, samples_, &reachable_);
  std::vector<std::uint32_t> missed;
  for (std::uint32_t i = 0; i < samples_.size(); ++i) {
    if (reachable_.test(i) && times_in(seen, i, overlap) < overlap) missed.push_back(i);
  }
  return missed;
}

bool SamplePool::join(const std::vector<std::uint32_t>& samples) {
  bool any = false;
  for (const std::uint32_t i : samples) {
    any |= !is_working_.test(i);
    is_working_.set(i);
  }
  if (any) working_samples_ = picked(samples_, is_working_);
  return any;
}

}  // namespace organbake
