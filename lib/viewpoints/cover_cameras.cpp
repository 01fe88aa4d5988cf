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
#include "viewpoints/outward.h"

namespace organbake {
namespace {

using Directions = CoverScene::Directions;

constexpr std::uint64_t kChoosingSeed = 1, kCheckingSeed = 2;
constexpr std::size_t kCheckingSamples = 16384;
// Steps of the relaxation, if all of it takes part in each (for organs with folds little does after
// the first hundred), and swaps.
constexpr double kRelaxationSteps = 500, kFoldedRelaxationSteps = 3000;
constexpr int kSwaps = 1000, kPolishRounds = 2;
// Swaps per repair, of one camera: many cameras are repaired in many steps.
constexpr int kRepairSwaps = 12'000;
// Samples that fewer candidates see get more candidates, out of a finer lattice.
constexpr double kSameDirection_rad = 1e-3;
constexpr int kFewCandidates = 6, kFineDirections = 8192;
// Where these are more than such a share of what the goal lets go, it is them who decide, each in a
// place of its own: so many times the samples are taken, or others would tell of much less
// coverage.
constexpr double kFolded = 0.5;
constexpr std::size_t kFinerSamples = 4;

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
    sample(goal_.samples);
    folded_ =
        static_cast<double>(seen_by_fewer_than(kFewCandidates).count()) > kFolded * missable();
    if (folded_) sample(kFinerSamples * static_cast<std::size_t>(goal_.samples));
    sample_for_checking();
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
  void sample(std::size_t count) {
    samples_ = scene_.samples(count, kChoosingSeed);
    reachable_ = scene_.reachable(samples_);
    seen_ = scene_.seen_well(candidates_, samples_, &reachable_);
  }

  void sample_for_checking() {
    checking_ = scene_.samples(kCheckingSamples, kCheckingSeed);
    reachable_checking_ = scene_.reachable(checking_);
    if (reachable_.count() > 0 && reachable_checking_.count() > 0) return;
    throw BadDataError(
        "surface to place cameras round: no view of the region shows any of it at less than 60°" +
        (goal_.texel_mm > 0 ? " with texels of " + to_text(goal_.texel_mm) +
                                  " mm; allow larger texels or make larger maps"
                            : std::string("; do its faces look outward?")));
  }

  // How many samples the goal lets go.
  double missable() const { return (1 - goal_.share) * static_cast<double>(reachable_.count()); }

  // Samples that fewer than so many candidates see, of those that count.
  SampleBits seen_by_fewer_than(int limit) const {
    SampleBits few(samples_.size());
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (reachable_.test(i) && times_in(seen_, i, limit) < limit) few.set(i);
    }
    return few;
  }

  // What lies deep shows itself from a few directions only, and the even candidates may pass them
  // by: of a finer lattice those join that together show each of these samples often enough.
  void add_candidates_for_the_hidden() {
    const SampleBits few = seen_by_fewer_than(kFewCandidates);
    if (few.count() == 0) return;
    const Directions fine = scene_.stands(kFineDirections);
    const std::vector<SampleBits> seen = scene_.seen_well(fine, samples_, &few);
    const CoverRelaxation unpriced{0, std::vector<double>(samples_.size(), 0.0),
                                   std::vector<double>(fine.size(), 0.0)};
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
    const std::vector<SampleBits> seen = scene_.seen_well(directions, samples_, &reachable_);
    candidates_.insert(candidates_.end(), directions.begin(), directions.end());
    seen_.insert(seen_.end(), seen.begin(), seen.end());
  }

  void choose() {
    most_samples_ = reachable_.count() - seen_by_fewer_than(goal_.overlap).count();
    const auto wanted =
        static_cast<std::size_t>(std::ceil(goal_.share * static_cast<double>(reachable_.count())));
    cover_goal_ = {std::min(wanted, most_samples_), goal_.overlap};
    relaxation_ = relax_cover(seen_, reachable_, cover_goal_,
                              folded_ ? kFoldedRelaxationSteps : kRelaxationSteps);
    context_.throw_if_cancelled();
    summary_.lower_bound = relaxation_.lower_bound;
    summary_.candidates = candidates_.size();
    search_.emplace(seen_, reachable_, relaxation_, goal_.overlap);
    cover_ = search_->fewest(cover_goal_, kMostCoverCameras, kSwaps);
    if (!folded_) try_without_prices();
    double reach_rad = scene_.spacing_rad(static_cast<std::size_t>(goal_.candidates));
    for (int round = 0; round < kPolishRounds; ++round) {
      reach_rad /= 2;
      polish(reach_rad);
    }
  }

  // Prices lead to deep places first; where there are none, equal samples may lead to fewer.
  void try_without_prices() {
    CoverRelaxation unpriced = relaxation_;
    std::fill(unpriced.prices.begin(), unpriced.prices.end(), 0.0);
    const CoverSearch search(seen_, reachable_, unpriced, goal_.overlap);
    const ChosenCover cover = search.fewest(cover_goal_, kMostCoverCameras, kSwaps);
    if (cover.covered < cover_goal_.samples || cover.chosen.size() >= cover_.chosen.size()) return;
    cover_ = cover;
    relaxation_.prices = unpriced.prices;
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
    search_.emplace(seen_, reachable_, relaxation_, goal_.overlap);
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

  // The chosen were made for their samples; others tell a little less. More is asked of the former
  // until the latter say that it is enough.
  void reach_on_checking_samples() {
    CoverGoal raised = cover_goal_;
    for (;;) {
      context_.throw_if_cancelled();
      chosen_.clear();
      for (const std::uint32_t c : cover_.chosen) chosen_.push_back(candidates_[c]);
      summary_.coverage = coverage_of_checking();
      summary_.reached = summary_.coverage >= goal_.share;
      if (summary_.reached || cover_.covered >= most_samples_) return;
      const double lacking =
          (goal_.share - summary_.coverage) * static_cast<double>(reachable_.count());
      raised.samples = std::min(most_samples_, std::max(raised.samples, cover_.covered) + 1 +
                                                   static_cast<std::size_t>(lacking));
      const int repair_swaps = kRepairSwaps / static_cast<int>(cover_.chosen.size());
      const ChosenCover repaired =
          search_->repaired(cover_, raised, kMostCoverCameras, repair_swaps);
      if (repaired.covered <= cover_.covered) return;
      cover_ = repaired;
    }
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
  SurfaceSamples samples_, checking_;
  SampleBits reachable_, reachable_checking_;
  Directions candidates_, chosen_;
  std::vector<SampleBits> seen_;
  bool folded_ = false;           // deep places decide
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
