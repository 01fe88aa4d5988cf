// SPDX-License-Identifier: Apache-2.0
// Cuts while the player runs. What blades sweep is gathered in each step; a thread of its own works
// out the parted organs, with all that draws and moves them, while the old ones are still shown,
// and a later step takes them over whole.
#include <algorithm>
#include <atomic>
#include <exception>
#include <span>
#include <utility>

#include "organbake/core/background_thread.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/player/player.h"

namespace organbake {

namespace {

constexpr int kLongestWait = 600;  // steps; a cut that no thread has made by then is waited for

}  // namespace

// The organs as they are once what blades have swept has parted, in the making.
struct Player::PendingCut {
  struct Organ {
    std::optional<CutSheet> sheet;  // none: no blade was near
    std::unique_ptr<CutOrgan> cutting;
    bool changed = false;
    // Of what has changed, which is drawn by it, and whose nodes lay there in what is shown.
    std::optional<Warper> warper;
    std::vector<NodeSource> node_sources;
  };
  std::vector<Organ> organs;
  std::optional<Deformer> deformer;  // when any has
  int steps_left = kCutDelaySteps;
  // What was shown before ends on the next thread: to take it down takes as long as a frame.
  std::shared_ptr<PendingCut> retired;
  std::exception_ptr failed;
  std::atomic<bool> done = false;
  std::optional<BackgroundThread> thread;  // last: it works on the rest

  bool under_way() const { return thread.has_value(); }
  bool ready() const { return done || steps_left < -kLongestWait; }
  // What is shown stays as it is until finish().
  void begin(std::span<const Player::Organ> shown, const DeformOptions& options);
  void finish(std::span<const Player::Organ> shown, const DeformOptions& options);

 private:
  void run(std::span<const Player::Organ> shown, const DeformOptions& options);
  void part(std::span<const Player::Organ> shown, const DeformOptions& options);
  void remake_drawn(std::span<const Player::Organ> shown);
};

void Player::PendingCut::begin(std::span<const Player::Organ> shown, const DeformOptions& options) {
  thread.emplace();
  thread->start([this, shown, options](const std::atomic<bool>&) { run(shown, options); });
}

// In a build without threads nothing has been done yet, so all of it is done now.
void Player::PendingCut::finish(std::span<const Player::Organ> shown,
                                const DeformOptions& options) {
  thread.reset();
  if (!done) run(shown, options);
  if (failed) std::rethrow_exception(failed);
}

void Player::PendingCut::run(std::span<const Player::Organ> shown, const DeformOptions& options) {
  try {
    part(shown, options);
  } catch (...) {
    failed = std::current_exception();
  }
  done = true;
}

void Player::PendingCut::part(std::span<const Player::Organ> shown, const DeformOptions& options) {
  retired.reset();
  DeformBodies bodies;
  bool any_changed = false;
  for (std::size_t o = 0; o < shown.size(); ++o) {
    Organ& next = organs[o];
    if (next.sheet) {
      next.cutting = std::make_unique<CutOrgan>(*shown[o].cutting);
      next.changed = next.cutting->part(*next.sheet);
    }
    any_changed = any_changed || next.changed;
    bodies.push_back(deform_body(next.changed ? next.cutting->now() : shown[o].now()));
  }
  if (!any_changed) return;
  // What is drawn and what moves know nothing of each other.
  parallel_both([&] { remake_drawn(shown); }, [&] { deformer.emplace(bodies, options); });
}

void Player::PendingCut::remake_drawn(std::span<const Player::Organ> shown) {
  for (std::size_t o = 0; o < shown.size(); ++o) {
    Organ& next = organs[o];
    if (!next.changed) continue;
    next.warper.emplace(shown[o].warper.cut(next.cutting->now(), next.cutting->face_parts()));
    next.node_sources = next.cutting->body().sources(shown[o].cutting->body());
  }
}

void Player::cut(const std::vector<Instrument>& instruments) {
  if (cut_is_due(steps_++)) end_pending_cut();
  sweep(instruments);
  if (!pending_cut_ || !pending_cut_->under_way()) begin_pending_cut();
}

bool Player::cut_is_due(std::size_t step) {
  const bool under_way = pending_cut_ && pending_cut_->under_way();
  const bool late = under_way && --pending_cut_->steps_left <= 0;
  if (!cut_times_) return late;
  auto& [steps, known_steps] = *cut_times_;
  const auto number = static_cast<std::uint32_t>(step);
  if (step < known_steps)
    return under_way && std::binary_search(steps.begin(), steps.end(), number);
  known_steps = step + 1;
  const bool due = late && pending_cut_->ready();
  if (due) steps.push_back(number);
  return due;
}

void Player::sweep(const std::vector<Instrument>& instruments) {
  const auto with_blade = [](const Instrument& i) { return i.active && has_blade(i.kind); };
  if (std::any_of(instruments.begin(), instruments.end(), with_blade)) {
    check_instruments(instruments);
    if (options_.solver != TissueSolver::fem)
      throw UsageError(
          "an instrument cuts, which springs cannot follow: play with the solver fem, from bundles "
          "with tetrahedra, which the bake makes unless it is told --set mechanics.fem=false");
  }
  const std::vector<CuttingStep> steps = cutting_edges_.advance(instruments);
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    Organ& organ = organs_[o];
    if (!organ.cutting && steps.empty()) continue;
    begin_cutting(organ);
    organ.sweeps->advance(
        steps, *organ.cutting,
        steps.empty() ? std::vector<Eigen::Vector3d>() : deformer_.node_positions(o));
  }
}

// Of the organs that have tetrahedra the skin keeps a hole where a needle went through.
void Player::leave_holes(const std::vector<Instrument>& instruments,
                         const std::vector<ContactPoint>& punctures) {
  if (options_.solver != TissueSolver::fem) return;
  for (const ContactPoint& puncture : punctures) {
    Organ& organ = organs_[puncture.organ];
    begin_cutting(organ);
    const Instrument& needle = instruments[puncture.instrument];
    organ.sweeps->pierce(puncture.position_mm, needle.axis_mm.normalized(), needle.radius_mm,
                         *organ.cutting, deformer_.node_positions(puncture.organ));
  }
}

void Player::begin_cutting(Organ& organ) {
  if (organ.cutting) return;
  organ.cutting = std::make_unique<CutOrgan>(organ.bundle);
  organ.sweeps = std::make_unique<BladeSweeps>(*organ.cutting);
}

// When blades have swept more than was taken.
void Player::begin_pending_cut() {
  const auto has_more = [](const Organ& organ) {
    return organ.sweeps && organ.sweeps->sheet().triangles().size() > organ.cutting->taken();
  };
  if (std::none_of(organs_.begin(), organs_.end(), has_more)) return;
  auto next = std::make_shared<PendingCut>();
  next->retired = std::move(pending_cut_);
  next->organs.resize(organs_.size());
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    if (has_more(organs_[o])) next->organs[o].sheet = organs_[o].sweeps->sheet();
  }
  next->begin(organs_, options_);
  pending_cut_ = std::move(next);
}

void Player::end_pending_cut() {
  pending_cut_->finish(organs_, options_);
  std::vector<std::vector<NodeSource>> sources;
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    Organ& organ = organs_[o];
    PendingCut::Organ& next = pending_cut_->organs[o];
    if (next.cutting) std::swap(organ.cutting, next.cutting);
    if (next.changed) {
      std::swap(organ.cut_warper, next.warper);
      organ.placed.reset();
      organ.positions = organ.cutting->now().proxy.vertices;
      sources.push_back(std::move(next.node_sources));
      continue;
    }
    sources.emplace_back();
    for (std::uint32_t n = 0; n < organ.now().mechanics.body->nodes_mm.size(); ++n)
      sources.back().push_back({{n, n, n, n}});
  }
  if (!pending_cut_->deformer) return;
  pending_cut_->deformer->continue_from(deformer_, sources, cut_times_.has_value());
  std::swap(deformer_, *pending_cut_->deformer);
  take_positions();
}

std::size_t Player::piece_count(std::size_t organ) const {
  const Organ& asked = organ_at(organ);
  return asked.cut_warper ? asked.cutting->body().cut().fragment_count() : 1;
}

}  // namespace organbake
