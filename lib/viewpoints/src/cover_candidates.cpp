// SPDX-License-Identifier: GPL-3.0-or-later
// Where cameras might stand: an even lattice, a finer one for what few of its directions show, and
// neighbours of the chosen ones.
#include "cover_candidates.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace organbake {
namespace {

// Two cameras in one place have no VPM.
constexpr double kSameDirection_rad = 1e-3;
// Samples that fewer candidates see get more candidates, out of a finer lattice.
constexpr int kFewCandidates = 6, kFineDirections = 8192;

}  // namespace

CoverCandidates::CoverCandidates(const CoverScene& scene, const SamplePool& pool,
                                 Directions directions)
    : scene_(scene), pool_(pool), directions_(std::move(directions)) {
  look();
}

CoverCandidates::Directions CoverCandidates::directions_of(const ChosenCover& cover) const {
  Directions directions;
  for (const std::uint32_t c : cover.chosen) directions.push_back(directions_[c]);
  return directions;
}

SurfaceSamples CoverCandidates::seen_by_fewer_than(int times) const {
  SurfaceSamples few;
  for (std::size_t i = 0; i < pool_.working().size(); ++i) {
    if (times_in(seen_, i, times) < times) append_sample(pool_.working(), i, few);
  }
  return few;
}

std::size_t CoverCandidates::seen_by(int times) const {
  return pool_.working().size() - seen_by_fewer_than(times).size();
}

void CoverCandidates::look() { seen_ = scene_.seen_well(directions_, pool_.working(), nullptr); }

void CoverCandidates::look_at_joined(const SurfaceSamples& joined) {
  const std::vector<SampleBits> seen = scene_.seen_well(directions_, joined, nullptr);
  for (std::size_t c = 0; c < seen_.size(); ++c) seen_[c].append(seen[c]);
}

void CoverCandidates::add_for_the_hidden() {
  const SurfaceSamples few = seen_by_fewer_than(kFewCandidates);
  if (few.size() == 0) return;
  const Directions fine = scene_.stands(kFineDirections);
  const ChosenCover more = greedy_cover(scene_.seen_well(fine, few, nullptr), {},
                                        {few.size(), kFewCandidates}, fine.size());
  Directions added;
  for (const std::uint32_t c : more.chosen) added.push_back(fine[c]);
  append(added);
}

void CoverCandidates::add_round(const ChosenCover& cover, double reach_rad) {
  Directions added;
  for (const Eigen::Vector3d& d : directions_of(cover)) {
    const Eigen::Vector3d side = d.unitOrthogonal(), up = d.cross(side);
    for (int k = 0; k < 6; ++k) {
      const double turn = k * std::numbers::pi / 3;
      const Eigen::Vector3d to =
          (d + reach_rad * (std::cos(turn) * side + std::sin(turn) * up)).normalized();
      if (scene_.may_stand(to)) added.push_back(to);
    }
  }
  append(added);
}

// Those that are candidates already are left out.
void CoverCandidates::append(const Directions& given) {
  const double same = std::cos(kSameDirection_rad);
  Directions added;
  for (const Eigen::Vector3d& d : given) {
    const auto is_same = [&](const Eigen::Vector3d& other) { return d.dot(other) > same; };
    if (std::any_of(directions_.begin(), directions_.end(), is_same)) continue;
    if (std::any_of(added.begin(), added.end(), is_same)) continue;
    added.push_back(d);
  }
  const std::vector<SampleBits> seen = scene_.seen_well(added, pool_.working(), nullptr);
  directions_.insert(directions_.end(), added.begin(), added.end());
  seen_.insert(seen_.end(), seen.begin(), seen.end());
}

}  // namespace organbake
