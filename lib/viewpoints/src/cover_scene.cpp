// SPDX-License-Identifier: GPL-3.0-or-later
// What a coverage is chosen over: the organ, the viewing region, and samples of what it can show.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/core/parallel.h"
#include "placing.h"

namespace organbake {
namespace {

ViewingCone widened(ViewingCone cone) {
  cone.half_angle_rad = std::min(cone.half_angle_rad + kBeyondRegion_rad, std::numbers::pi);
  return cone;
}

double cap_area(const ViewingCone& cone) {
  return 2 * std::numbers::pi * (1 - std::cos(cone.half_angle_rad));
}

}  // namespace

CoverScene::CoverScene(const TriangleMesh& surface, const OrganFrame& organ,
                       const PlacementOptions& options, const RunContext& context)
    : surface_(surface),
      organ_(organ),
      options_(options),
      context_(context),
      region_(options.region()),
      stand_(widened(region_)),
      sight_(surface) {
  constexpr int kDistanceDirections = 64;
  distance_mm_ = organ.common_distance_mm(stands(kDistanceDirections), options, context);
}

CoverScene::Directions CoverScene::views(int count) const {
  return lattice_directions(count, region_.axis, region_.half_angle_rad, LatticeKind::off_rim);
}

CoverScene::Directions CoverScene::stands(int count) const {
  Directions stands =
      lattice_directions(count, region_.axis, region_.half_angle_rad, LatticeKind::on_rim);
  const double all = cap_area(stand_), beyond = all - cap_area(region_);
  if (beyond <= 0) return stands;
  const double least_cosine = std::cos(region_.half_angle_rad + spacing_rad(stands.size()) / 2);
  for (const Eigen::Vector3d& d :
       lattice_directions(static_cast<int>(0.5 * count * all / beyond), stand_.axis,
                          stand_.half_angle_rad, LatticeKind::on_rim)) {
    if (d.dot(region_.axis.normalized()) < least_cosine) stands.push_back(d);
  }
  return stands;
}

bool CoverScene::may_stand(const Eigen::Vector3d& direction) const {
  return stand_.half_angle_rad >= std::numbers::pi - 1e-9 ||
         direction.dot(stand_.axis.normalized()) >= std::cos(stand_.half_angle_rad) - 1e-9;
}

double CoverScene::spacing_rad(std::size_t count) const {
  return even_spacing_rad(count, stand_.half_angle_rad);
}

Eigen::Vector3d CoverScene::eye_mm(const Eigen::Vector3d& direction) const {
  return organ_.center_mm() + distance_mm_ * direction;
}

SurfaceSamples CoverScene::samples(std::size_t count, std::uint64_t seed) const {
  return sample_surface(surface_, count, seed);
}

std::vector<SampleBits> CoverScene::seen_well(const Directions& cameras,
                                              const SurfaceSamples& samples,
                                              const SampleBits* among) const {
  context_.throw_if_cancelled();
  return sight_.seen_from_each(eyes(cameras, goal().texel_mm), samples, well(), among);
}

std::vector<std::uint32_t> CoverScene::missed(const Directions& cameras,
                                              const SurfaceSamples& samples,
                                              const SampleBits& among) const {
  const std::vector<SampleBits> seen = seen_well(cameras, samples, &among);
  std::vector<std::uint32_t> missed;
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    if (among.test(i) && times_in(seen, i, goal().overlap) < goal().overlap) missed.push_back(i);
  }
  return missed;
}

SampleBits CoverScene::reachable(const SurfaceSamples& samples) const {
  context_.throw_if_cancelled();
  return sight_.seen_from_any(eyes(views(kRegionViews), goal().texel_mm), samples, well());
}

std::vector<SampleBits> CoverScene::visible(const Directions& cameras,
                                            const SurfaceSamples& samples) const {
  return sight_.seen_from_each(eyes(cameras, 0), samples, {});
}

Placement CoverScene::placed(const Directions& cameras) const {
  const double distance =
      std::max(distance_mm_, organ_.common_distance_mm(cameras, options_, context_));
  return placement_of(organ_, cameras, distance, options_);
}

// Focal lengths only where texels are limited: they take a look at every vertex.
std::vector<Eye> CoverScene::eyes(const Directions& directions, double texel_mm) const {
  std::vector<Eye> eyes(directions.size());
  parallel_for(std::size_t{0}, directions.size(), [&](std::size_t k) {
    eyes[k] = {eye_mm(directions[k]), -directions[k], 0};
    if (texel_mm > 0) {
      eyes[k].focal_px = organ_.camera(directions[k], distance_mm_, options_).intrinsics.fx;
    }
  });
  return eyes;
}

// Samples that cameras are chosen by: on folded surfaces those that are hardest to see, for the
// rest is seen by whatever shows these.
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
