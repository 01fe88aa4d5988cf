// SPDX-License-Identifier: GPL-3.0-or-later
// Cameras for a coverage goal: candidates and samples are refined where they decide (deep places,
// neighbourhoods of chosen cameras), and cameras are added until views over the VPM find what they
// show. What is said of the result is measured on samples that had no part in it.
#include "placing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

// Where cameras might stand: an even lattice, a finer one for what few of its directions show, and
// neighbours of the chosen ones.

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

// Two cameras in one place have no VPM.
constexpr double kSameDirection_rad = 1e-3;

// Samples that fewer candidates see get more candidates, out of a finer lattice.
constexpr int kFewCandidates = 6, kFineDirections = 8192;

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

using Directions = CoverScene::Directions;

constexpr std::uint64_t kChoosingSeed = 1, kCheckingSeed = 2;
constexpr std::size_t kCheckingSamples = 16384, kFoldedCheckingSamples = 65536;
// So often each chosen camera is tried against each candidate, on average: for the first choice,
// and for one that goes on from there, where it need not get so hot again.
constexpr double kFirstTries = 10, kFurtherTries = 5;
constexpr double kWarm = 0.1;
constexpr int kPolishRounds = 2;

// A few at a time, apart from each other and from the cameras there are.
Directions worst_views(const CoverScene& scene, const Directions& cameras, const Directions& views,
                       const std::vector<double>& gaps) {
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return gaps[a] > gaps[b]; });
  Directions taken = cameras, more;
  const double apart_rad = 0.7 * scene.spacing_rad(cameras.size());
  const std::size_t most = std::min(1 + cameras.size() / 10, kMostCoverCameras - cameras.size());
  for (const std::size_t v : order) {
    if (more.size() >= most || !(gaps[v] > 0)) break;
    const bool free = std::none_of(taken.begin(), taken.end(), [&](const Eigen::Vector3d& d) {
      const double near_rad = more.empty() ? 0.3 * apart_rad : apart_rad;
      return d.dot(views[v]) > std::cos(near_rad);
    });
    if (!free) continue;
    taken.push_back(views[v]);
    more.push_back(views[v]);
  }
  return more;
}

// The cameras, and more of them at the worst views until views over the VPM miss, on average, no
// more than kViewGap of what they show (see ViewCertificate).
Placement complete_views(const CoverScene& scene, const Directions& given) {
  constexpr std::uint64_t kViewSeed = 3;
  constexpr std::size_t kViewSamples = 2048;
  constexpr int kCertificateViews = 512;
  constexpr double kViewGap = 0.001;
  constexpr double kSpare = 0.9;  // the samples of a report are others: a little to spare
  Placement placement = scene.placed(given);
  const SurfaceSamples samples = scene.samples(kViewSamples, kViewSeed);
  const Directions views = scene.views(kCertificateViews);
  std::vector<Eigen::Vector3d> eyes_mm;
  for (const Eigen::Vector3d& view : views) eyes_mm.push_back(scene.eye_mm(view));
  const std::vector<SampleBits> seen = scene.visible(views, samples);
  Directions cameras = given;
  std::vector<SampleBits> kept = scene.visible(cameras, samples);
  while (cameras.size() < kMostCoverCameras) {
    scene.context().throw_if_cancelled();
    const ViewCertificate certificate =
        certify_views(placement.manifold, kept, eyes_mm, seen, samples);
    if (certificate.mean_gap <= kSpare * kViewGap) break;
    const Directions more = worst_views(scene, cameras, views, certificate.gaps);
    if (more.empty()) break;
    const std::vector<SampleBits> theirs = scene.visible(more, samples);
    cameras.insert(cameras.end(), more.begin(), more.end());
    kept.insert(kept.end(), theirs.begin(), theirs.end());
    placement = scene.placed(cameras);
  }
  return placement;
}

class CameraCover {
 public:
  CameraCover(const TriangleMesh& surface, const OrganFrame& organ, const PlacementOptions& options,
              const RunContext& context)
      : scene_(surface, organ, options, context), goal_(scene_.goal()), context_(context) {}

  Placement run() {
    sample();
    context_.progress(0.3);
    choose();
    if (pool_->folded()) refine();
    context_.progress(0.7);
    reach_on_checking_samples();
    context_.progress(0.9);
    Placement placement = complete_views(scene_, chosen_);
    summary_.for_coverage = chosen_.size();
    tell();
    placement.cover = summary_;
    return placement;
  }

 private:
  void sample() {
    Directions even = scene_.stands(goal_.candidates);
    pool_.emplace(scene_, even, static_cast<std::size_t>(goal_.samples), kChoosingSeed);
    checking_ =
        scene_.samples(pool_->folded() ? kFoldedCheckingSamples : kCheckingSamples, kCheckingSeed);
    reachable_checking_ = scene_.reachable(checking_);
    if (pool_->reachable() == 0 || reachable_checking_.count() == 0) throw nothing_reachable();
    candidates_.emplace(scene_, *pool_, std::move(even));
    candidates_->add_for_the_hidden();
  }

  BadDataError nothing_reachable() const {
    return BadDataError(
        "surface to place cameras round: no view of the region shows any of it at less than 60°" +
        (goal_.texel_mm > 0 ? " with texels of " + to_text(goal_.texel_mm) +
                                  " mm; allow larger texels or make larger maps"
                            : std::string("; do its faces look outward?")));
  }

  // By the working samples; then, twice, with more candidates round each camera.
  void choose() {
    let_miss_what_the_goal_lets();
    const ChosenCover greedy =
        greedy_cover(candidates_->seen(), {}, cover_goal_, kMostCoverCameras);
    cover_ = annealed(greedy, kFirstTries, {});
    double reach_rad = scene_.spacing_rad(static_cast<std::size_t>(goal_.candidates));
    for (int round = 0; round < kPolishRounds; ++round) {
      reach_rad /= 2;
      candidates_->add_round(cover_, reach_rad);
      cover_ = annealed(cover_, kFurtherTries, {.hot = kWarm});
    }
  }

  // On more samples, and with candidates for what hides among them.
  void refine() {
    pool_->refine();
    candidates_->look();
    candidates_->add_for_the_hidden();
    let_miss_what_the_goal_lets();
    cover_ = repaired_cover();
  }

  void let_miss_what_the_goal_lets() {
    may_miss_ =
        static_cast<std::size_t>((1 - goal_.share) * static_cast<double>(pool_->reachable()));
    set_cover_goal();
  }
  void set_cover_goal() {
    const std::size_t working = pool_->working().size();
    cover_goal_ = {
        std::min(working - std::min(working, may_miss_), candidates_->seen_by(goal_.overlap)),
        goal_.overlap};
  }

  ChosenCover annealed(const ChosenCover& start, double tries, Annealing annealing) const {
    annealing.moves = static_cast<std::size_t>(tries * static_cast<double>(start.chosen.size()) *
                                               static_cast<double>(candidates_->size()));
    return annealed_cover(candidates_->seen(), start, cover_goal_, annealing, context_);
  }

  // As many cameras as do, found from below: so many more at a time as should give half of what is
  // lacking, by what each of them gives of it.
  ChosenCover repaired_cover() const {
    ChosenCover cover = cover_;
    for (;;) {
      cover = annealed(cover, kFurtherTries, {.hot = kWarm});
      const std::size_t count = cover.chosen.size();
      if (cover.covered >= cover_goal_.samples || count >= kMostCoverCameras) return cover;
      const double each =
          std::max(1.0, static_cast<double>(may_miss_) / static_cast<double>(count));
      const double half = 0.5 * static_cast<double>(cover_goal_.samples - cover.covered);
      const std::size_t more = 1 + static_cast<std::size_t>(half / each);
      cover = greedy_cover(candidates_->seen(), cover, cover_goal_,
                           std::min(kMostCoverCameras, count + more));
      if (cover.chosen.size() == count) return cover;
    }
  }

  // The chosen were made for the working samples. Those that they miss of the pool join, until the
  // goal is reached there, too; then fewer are let go until other samples say that it is enough.
  void reach_on_checking_samples() {
    for (;;) {
      context_.throw_if_cancelled();
      chosen_ = candidates_->directions_of(cover_);
      const std::vector<std::uint32_t> missed = pool_->missed_by(chosen_);
      context_.debug(std::to_string(chosen_.size()) + " cameras miss " +
                     std::to_string(missed.size()) + " samples and may miss " +
                     std::to_string(may_miss_) + " of " + std::to_string(pool_->reachable()));
      const SurfaceSamples joined = pool_->join(missed);
      const bool reached_of_pool = missed.size() <= may_miss_;
      if (reached_of_pool || joined.size() == 0) {
        summary_.coverage = coverage_of_checking();
        summary_.reached = summary_.coverage >= goal_.share;
        if (summary_.reached || !reached_of_pool || missed.empty()) return;  // or no more to be had
        const double lacking =
            (goal_.share - summary_.coverage) * static_cast<double>(pool_->reachable());
        may_miss_ = missed.size() - std::min(missed.size(), static_cast<std::size_t>(lacking) + 1);
      }
      candidates_->look_at_joined(joined);
      set_cover_goal();
      cover_ = repaired_cover();
    }
  }

  double coverage_of_checking() const {
    const std::size_t of = reachable_checking_.count();
    const std::size_t missed = scene_.missed(chosen_, checking_, reachable_checking_).size();
    return static_cast<double>(of - missed) / static_cast<double>(of);
  }

  void tell() const {
    if (summary_.reached) return;
    context_.warn(
        "cameras see only " + percent(summary_.coverage, 2) +
        " of the reachable surface as often as asked for, " + std::to_string(goal_.overlap) +
        " times, " + percent(goal_.share - summary_.coverage, 2) + " less than the " +
        percent(goal_.share, 2) + " of the goal; more --candidates or less --overlap may help");
  }

  CoverScene scene_;
  const CoverageGoal& goal_;
  const RunContext& context_;
  std::optional<SamplePool> pool_;
  std::optional<CoverCandidates> candidates_;
  SurfaceSamples checking_;
  SampleBits reachable_checking_;
  std::size_t may_miss_ = 0;  // of the pool
  CoverGoal cover_goal_;      // of its working samples, for that
  ChosenCover cover_;
  Directions chosen_;
  CoverSummary summary_;
};

}  // namespace

Placement cover_with_cameras(const TriangleMesh& surface, const OrganFrame& organ,
                             const PlacementOptions& options, const RunContext& context) {
  return CameraCover(surface, organ, options, context).run();
}

}  // namespace organbake
