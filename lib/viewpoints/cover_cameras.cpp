// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints/cover_cameras.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/text.h"
#include "viewpoints/choose_cover.h"
#include "viewpoints/complete_views.h"
#include "viewpoints/cover_program.h"
#include "viewpoints/outward.h"
#include "viewpoints/sample_pool.h"

namespace organbake {
namespace {

using Directions = CoverScene::Directions;

constexpr std::uint64_t kChoosingSeed = 1, kCheckingSeed = 2;
constexpr std::size_t kCheckingSamples = 16384, kFoldedCheckingSamples = 65536;
// Of the relaxations: steps, if all of it takes part in each; pivots.
constexpr double kRelaxationSteps = 500;
constexpr int kMostPivots = 60'000;
constexpr double kRaisedShare = 0.15;  // of what the goal lets go
constexpr int kSwaps = 1000, kPolishRounds = 2;
// Swaps per repair, of one camera: many cameras are repaired in many steps.
constexpr int kRepairSwaps = 12'000;
// Samples that fewer candidates see get more candidates, out of a finer lattice.
constexpr double kSameDirection_rad = 1e-3;
constexpr int kFewCandidates = 6, kFineDirections = 8192;

class CameraCover {
 public:
  CameraCover(const TriangleMesh& surface, const OrganFrame& organ, const PlacementOptions& options,
              const RunContext& context)
      : surface_(outward(surface, context)),
        scene_(surface_, organ, options, context),
        goal_(scene_.goal()),
        context_(context) {}

  Placement run() {
    candidates_ = scene_.stands(goal_.candidates);
    sample();
    context_.progress(0.2);
    look();
    add_candidates_for_the_hidden();
    context_.progress(0.3);
    choose();
    context_.progress(0.7);
    reach_on_checking_samples();
    summary_.for_coverage = chosen_.size();
    context_.progress(0.9);
    Placement placement = complete_views(scene_, chosen_);
    summary_.for_views = placement.cameras.size() - chosen_.size();
    tell();
    placement.cover = summary_;
    return placement;
  }

 private:
  void sample() {
    pool_.emplace(scene_, candidates_, static_cast<std::size_t>(goal_.samples), kChoosingSeed);
    checking_ =
        scene_.samples(pool_->folded() ? kFoldedCheckingSamples : kCheckingSamples, kCheckingSeed);
    reachable_checking_ = scene_.reachable(checking_);
    if (pool_->reachable() > 0 && reachable_checking_.count() > 0) return;
    throw BadDataError(
        "surface to place cameras round: no view of the region shows any of it at less than 60°" +
        (goal_.texel_mm > 0 ? " with texels of " + to_text(goal_.texel_mm) +
                                  " mm; allow larger texels or make larger maps"
                            : std::string("; do its faces look outward?")));
  }

  // What the candidates see of the working samples.
  void look() {
    seen_ = scene_.seen_well(candidates_, pool_->working(), nullptr);
    all_ = SampleBits(pool_->working().size());
    for (std::size_t i = 0; i < all_.size(); ++i) all_.set(i);
    most_samples_ = all_.size() - seen_by_fewer_than(goal_.overlap).count();
  }

  // Working samples that fewer candidates see.
  SampleBits seen_by_fewer_than(int limit) const {
    SampleBits few(all_.size());
    for (std::size_t i = 0; i < few.size(); ++i) {
      if (times_in(seen_, i, limit) < limit) few.set(i);
    }
    return few;
  }

  // What lies deep shows itself from a few directions only, and the even candidates may pass them
  // by: of a finer lattice those join that together show each of these samples often enough.
  void add_candidates_for_the_hidden() {
    const SampleBits few = seen_by_fewer_than(kFewCandidates);
    if (few.count() == 0) return;
    const Directions fine = scene_.stands(kFineDirections);
    const std::vector<SampleBits> seen = scene_.seen_well(fine, pool_->working(), &few);
    const CoverRelaxation unpriced{0, std::vector<double>(few.size(), 0.0), {}, {}};
    const ChosenCover more = CoverSearch(seen, few, unpriced, kFewCandidates)
                                 .greedy({few.count(), kFewCandidates}, fine.size());
    Directions added;
    for (const std::uint32_t c : more.chosen) added.push_back(fine[c]);
    append(added);
  }

  // Those that are candidates already are left out: two cameras in one place have no VPM.
  void append(const Directions& given) {
    const double same = std::cos(kSameDirection_rad);
    Directions directions;
    for (const Eigen::Vector3d& d : given) {
      const auto is_same = [&](const Eigen::Vector3d& other) { return d.dot(other) > same; };
      if (std::any_of(candidates_.begin(), candidates_.end(), is_same)) continue;
      if (std::any_of(directions.begin(), directions.end(), is_same)) continue;
      directions.push_back(d);
    }
    const std::vector<SampleBits> seen = scene_.seen_well(directions, pool_->working(), nullptr);
    candidates_.insert(candidates_.end(), directions.begin(), directions.end());
    seen_.insert(seen_.end(), seen.begin(), seen.end());
    most_samples_ = all_.size() - seen_by_fewer_than(goal_.overlap).count();
  }

  void choose() {
    choose_by_working_samples();
    double reach_rad = scene_.spacing_rad(static_cast<std::size_t>(goal_.candidates));
    for (int round = 0; round < kPolishRounds; ++round) {
      reach_rad /= 2;
      polish(reach_rad);
    }
  }

  // Samples that the working ones stand for: of the pool, or of its even part.
  std::size_t judged() const { return pool_->folded() ? pool_->reachable() : all_.size(); }
  // Those of them that the goal lets go.
  std::size_t spare() const {
    return static_cast<std::size_t>((1 - goal_.share) * static_cast<double>(judged()));
  }

  Directions directions_of(const ChosenCover& cover) const {
    Directions directions;
    for (const std::uint32_t c : cover.chosen) directions.push_back(candidates_[c]);
    return directions;
  }

  // Cameras are made for their samples; others tell of a little less. Where a few deep places
  // decide, one that it takes into account at once takes fewer cameras than one added later.
  std::size_t raised_goal() const {
    const double more = pool_->folded() ? kRaisedShare * static_cast<double>(spare()) : 0;
    return std::min(cover_goal_.samples + static_cast<std::size_t>(more), most_samples_);
  }

  // Prices lead to deep places first; where there are none, equal samples may lead to fewer.
  void try_without_prices() {
    CoverRelaxation unpriced = relaxation_;
    std::fill(unpriced.prices.begin(), unpriced.prices.end(), 0.0);
    const CoverSearch search(seen_, all_, unpriced, goal_.overlap);
    const ChosenCover cover = search.fewest(cover_goal_, kMostCoverCameras, kSwaps);
    if (cover.covered < cover_goal_.samples || cover.chosen.size() >= cover_.chosen.size()) return;
    cover_ = cover;
    relaxation_.prices = unpriced.prices;
  }

  void choose_by_working_samples() {
    context_.throw_if_cancelled();
    cover_goal_ = {std::min(all_.size() - std::min(all_.size(), spare()), most_samples_),
                   goal_.overlap};
    relaxation_ = pool_->folded()
                      ? solve_cover(seen_, all_, cover_goal_, raised_goal(), kMostPivots, context_)
                      : relax_cover(seen_, all_, cover_goal_, kRelaxationSteps);
    context_.throw_if_cancelled();
    summary_.lower_bound = std::max(summary_.lower_bound, relaxation_.lower_bound);
    summary_.candidates = candidates_.size();
    search_.emplace(seen_, all_, relaxation_, goal_.overlap);
    cover_goal_.samples = raised_goal();
    cover_ = search_->fewest(cover_goal_, kMostCoverCameras, kSwaps);
    if (!pool_->folded()) try_without_prices();
  }

  // Six more candidates round each camera, and one camera less where they allow it.
  void polish(double reach_rad) {
    context_.throw_if_cancelled();
    Directions moved;
    for (const std::uint32_t c : cover_.chosen) {
      const Eigen::Vector3d d = candidates_[c], side = d.unitOrthogonal(), up = d.cross(side);
      for (int k = 0; k < 6; ++k) {
        const double turn = k * std::numbers::pi / 3;
        const Eigen::Vector3d to =
            (d + reach_rad * (std::cos(turn) * side + std::sin(turn) * up)).normalized();
        if (scene_.may_stand(to)) moved.push_back(to);
      }
    }
    append(moved);
    relaxation_.shares.resize(seen_.size(), 0.0);
    search_.emplace(seen_, all_, relaxation_, goal_.overlap);
    cover_ = search_->thinned(std::move(cover_), cover_goal_, kSwaps);
  }

  double coverage_of_checking() const {
    const std::vector<SampleBits> seen = scene_.seen_well(chosen_, checking_, &reachable_checking_);
    std::size_t covered = 0;
    for (std::size_t i = 0; i < checking_.size(); ++i) {
      covered += times_in(seen, i, goal_.overlap) >= goal_.overlap;
    }
    return static_cast<double>(covered) / static_cast<double>(reachable_checking_.count());
  }

  // The chosen were made for their samples; others tell a little less. Fewer of the former are let
  // go until the latter say that it is enough.
  void reach_on_checking_samples() {
    for (;;) {
      context_.throw_if_cancelled();
      chosen_ = directions_of(cover_);
      summary_.coverage = coverage_of_checking();
      summary_.reached = summary_.coverage >= goal_.share;
      if (summary_.reached || cover_.covered >= most_samples_) return;
      const std::size_t missed = join_missed();
      const auto lacking = static_cast<std::size_t>((goal_.share - summary_.coverage) *
                                                    static_cast<double>(judged()));
      const CoverGoal raised{
          std::min(all_.size() - missed + std::min(missed, lacking + 1), most_samples_),
          goal_.overlap};
      const int repair_swaps = kRepairSwaps / static_cast<int>(cover_.chosen.size());
      ChosenCover repaired = search_->repaired(cover_, raised, kMostCoverCameras, repair_swaps);
      if (repaired.covered <= search_->covered(cover_.chosen)) return;
      cover_ = std::move(repaired);
    }
  }

  // Makes working ones of all samples that the chosen miss; returns their number.
  std::size_t join_missed() {
    if (!pool_->folded()) return all_.size() - cover_.covered;
    const std::vector<std::uint32_t> missed = pool_->missed_by(chosen_, goal_.overlap);
    if (!pool_->join(missed)) return missed.size();
    look();
    relaxation_.prices.assign(all_.size(), 0.0);  // those that joined have none
    search_.emplace(seen_, all_, relaxation_, goal_.overlap);
    return missed.size();
  }

  void tell() const {
    if (summary_.reached) return;
    context_.warn("cameras see " + to_text(100 * summary_.coverage, 2) + " % of the reachable " +
                  "surface " + std::to_string(goal_.overlap) + " times, not the " +
                  to_text(100 * goal_.share, 2) +
                  " % asked for; more --candidates or less --overlap may help");
  }

  TriangleMesh surface_;
  CoverScene scene_;
  const CoverageGoal& goal_;
  const RunContext& context_;
  SurfaceSamples checking_;
  SampleBits reachable_checking_;
  Directions candidates_, chosen_;
  std::optional<SamplePool> pool_;
  std::vector<SampleBits> seen_;  // of the pool's working samples, by candidate
  SampleBits all_;                // of them
  std::size_t most_samples_ = 0;  // that enough candidates see at all
  CoverGoal cover_goal_;
  CoverRelaxation relaxation_;
  std::optional<CoverSearch> search_;
  ChosenCover cover_;
  CoverSummary summary_;
};

}  // namespace

Placement cover_with_cameras(const TriangleMesh& surface, const OrganFrame& organ,
                             const PlacementOptions& options, const RunContext& context) {
  return CameraCover(surface, organ, options, context).run();
}

}  // namespace organbake
