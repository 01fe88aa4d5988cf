// SPDX-License-Identifier: Apache-2.0
// Cuts while the player runs. What blades sweep is gathered in each step; a thread of its own works
// out the parted organs, with all that draws and moves them, while the old ones are still shown,
// and a later step takes them over whole.
#include <algorithm>
#include <atomic>
#include <exception>
#include <span>
#include <utility>

#include "organbake/core/background.h"
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
    std::shared_ptr<const CutSheet> sheet;  // none: no blade was near
    std::shared_ptr<const CutOrgan> cutting;
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
      const auto parted = std::make_shared<CutOrgan>(*shown[o].cutting);
      next.changed = parted->part(*next.sheet);
      next.cutting = parted;
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
    if (steps.empty() && (!organ.sweeps || organ.sweeps->lifted())) continue;
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

// Readies an organ for blades; what they sweep is taken from states that have it, too.
void Player::begin_cutting(Organ& organ) {
  if (!organ.cutting) organ.cutting = std::make_shared<const CutOrgan>(organ.bundle);
  if (!organ.sweeps) {
    organ.sweeps = std::make_shared<BladeSweeps>(*organ.cutting);
  } else if (organ.sweeps.use_count() > 1) {
    organ.sweeps = std::make_shared<BladeSweeps>(*organ.sweeps);
  }
  organ.sweeps->set_step(steps_);
}

// When blades have swept more than was taken.
void Player::begin_pending_cut() {
  const auto has_more = [](const Organ& organ) {
    return organ.sweeps && organ.sweeps->sheet().triangles().size() > organ.cutting->taken();
  };
  if (std::none_of(organs_.begin(), organs_.end(), has_more)) return;
  Sheets sheets;
  for (const Organ& organ : organs_)
    sheets.push_back(has_more(organ) ? std::make_shared<const CutSheet>(organ.sweeps->sheet())
                                     : nullptr);
  begin_pending_cut(std::move(sheets));
}

void Player::begin_pending_cut(Sheets sheets) {
  auto next = std::make_shared<PendingCut>();
  next->retired = std::move(pending_cut_);
  next->organs.resize(organs_.size());
  for (std::size_t o = 0; o < organs_.size(); ++o) next->organs[o].sheet = std::move(sheets[o]);
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

// The moment without what can be made again: the warpers and the solver of organs that are cut.
struct Player::State::Data {
  struct Organ {
    std::shared_ptr<const CutOrgan> cutting;
    bool cut = false;
    std::shared_ptr<const BladeSweeps> sweeps;
    std::optional<OrganState> placed;  // by another solver, since the last step
    StateOf placed_of = StateOf::vertices;
  };
  std::weak_ptr<const void> of;
  DeformOptions played;
  std::size_t steps = 0;
  CuttingEdges cutting_edges;
  std::vector<Organ> organs;
  Sheets pending;  // of a cut that is under way; else empty
  int pending_steps_left = 0;
  Deformer::State tissue;
};

std::size_t Player::State::steps() const { return data_ ? data_->steps : 0; }

std::size_t Player::State::bytes_beside(const State& other) const {
  if (!data_) return 0;
  static const Data kNone;
  const Data& beside = other.data_ ? *other.data_ : kNone;
  std::size_t bytes = sizeof(Data) + data_->tissue.bytes_beside(beside.tissue);
  for (std::size_t o = 0; o < data_->organs.size(); ++o) {
    const Data::Organ& own = data_->organs[o];
    const Data::Organ& its = o < beside.organs.size() ? beside.organs[o] : Data::Organ{};
    bytes += sizeof own;
    if (own.cutting && own.cutting != its.cutting) bytes += own.cutting->bytes();
    if (own.sweeps && own.sweeps != its.sweeps) bytes += own.sweeps->sheet().bytes();
    if (own.placed)
      bytes +=
          sizeof(Eigen::Vector3d) * (own.placed->vertices_mm.size() + own.placed->nodes_mm.size());
  }
  for (const auto& sheet : data_->pending) bytes += sheet ? sheet->bytes() : 0;
  return bytes;
}

Player::State Player::save_state(const State& earlier) const {
  const auto data = std::make_shared<State::Data>();
  data->of = mark_;
  data->played = options_;
  data->steps = steps_;
  data->cutting_edges = cutting_edges_;
  for (const Organ& organ : organs_) {
    State::Data::Organ& saved = data->organs.emplace_back();
    saved.cutting = organ.cutting;
    saved.cut = organ.cut_warper.has_value();
    saved.sweeps = organ.sweeps;
    save_placed(organ, saved.placed, saved.placed_of);
  }
  if (pending_cut_ && pending_cut_->under_way()) {
    for (const PendingCut::Organ& organ : pending_cut_->organs)
      data->pending.push_back(organ.sheet);
    data->pending_steps_left = pending_cut_->steps_left;
  }
  data->tissue = deformer_.save_state(earlier.data_ ? earlier.data_->tissue : Deformer::State{});
  State state;
  state.data_ = data;
  return state;
}

bool Player::hang_together_as_in(const State::Data& state) const {
  bool same = solver() == state.played.solver && options_.stiffness == state.played.stiffness;
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    const bool cut = organs_[o].cut_warper.has_value();
    same = same && cut == state.organs[o].cut &&
           (!cut || organs_[o].cutting == state.organs[o].cutting);
  }
  return same;
}

void Player::restore_state(const State& state) {
  if (!state) throw UsageError("an empty state cannot be restored: save one first");
  const State::Data& saved = *state.data_;
  if (saved.of.lock() != mark_)
    throw UsageError("a state of another player cannot be restored: save one of this player");
  pending_cut_.reset();  // its thread reads what changes now
  const bool remake = !hang_together_as_in(saved);
  options_ = saved.played;
  steps_ = saved.steps;
  cutting_edges_ = saved.cutting_edges;
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    Organ& organ = organs_[o];
    const State::Data::Organ& was = saved.organs[o];
    const bool other_cut = was.cut && (organ.cutting != was.cutting || !organ.cut_warper);
    organ.cutting = was.cutting;
    organ.sweeps = std::const_pointer_cast<BladeSweeps>(was.sweeps);  // begin_cutting() copies it
    organ.placed.reset();
    if (!was.cut) {
      organ.cut_warper.reset();
    } else if (other_cut) {
      organ.cut_warper.emplace(organ.warper.cut(organ.cutting->now(), organ.cutting->face_parts()));
    }
    organ.positions.resize(organ.now().proxy.vertices.size());
  }
  if (remake) deformer_ = Deformer(deform_bodies(organs_), options_);
  deformer_.restore_state(saved.tissue);
  take_positions();
  for (std::size_t o = 0; o < organs_.size(); ++o)
    restore_placed(organs_[o], saved.organs[o].placed, saved.organs[o].placed_of);
  if (saved.pending.empty()) return;
  begin_pending_cut(saved.pending);
  pending_cut_->steps_left = saved.pending_steps_left;
}

std::size_t Player::piece_count(std::size_t organ) const {
  const Organ& asked = organ_at(organ);
  return asked.cut_warper ? asked.cutting->body().cut().fragment_count() : 1;
}

}  // namespace organbake
