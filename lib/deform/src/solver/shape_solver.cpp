// SPDX-License-Identifier: Apache-2.0
// Projective dynamics (Bouaziz et al. 2014): local steps of the elements and one linear solve with
// a factor that is made once; contacts enter as constraints through that factor, so none
// refactorises. A fast tip is followed in pieces, or it would end up behind the skin.
#include "solver/shape_solver.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/stopwatch.h"

namespace organbake::deform {
namespace {

constexpr int kFinalRounds = 10;  // of contact search and solve
constexpr double kContactWithin_mm = 0.02;
constexpr double kVolumeWithin = 1e-4;  // of the rest volume
constexpr double kConverged_mm = 1e-4;  // local/global iterations stop below this change

// The inertial guess may cross this share of the object in one step, no more: faster tissue is a
// numerical accident, and would fold the mesh before the springs can answer.
constexpr double kFastestPerStep = 0.25;
// The same of a piece that hangs on nothing: it must not pass what it meets between two looks.
constexpr double kFastestAdrift = 0.01;
constexpr double kForesight = 0.8;  // of the last motion; 1 would leave the slow modes ringing
constexpr double kForesightLimit = 0.01;  // of the diagonal: directions farther ahead are guesses
// Of a sweep: in a longer one a tip that lost what it touched on the way may have left it behind.
constexpr int kFewPieces = 8;
// Of the radius: a piece this long cannot bring a tip's centre through the skin.
constexpr double kPieceOfRadius = 0.5;
constexpr int kMostPieces = 2048;  // a tip that is faster still may pass through
constexpr double kRunaway = 10;    // diagonals away from rest: the state is lost
constexpr double kUnknownEnergy = std::numeric_limits<double>::infinity();

double largest_diagonal(const DeformBodies& bodies) {
  double largest = 0;
  for (const DeformBody& body : bodies) largest = std::max(largest, bounds(body.proxy).diagonal());
  return largest;
}

// In how many pieces a step's sweeps have to be followed, so that none carries a tip past the skin.
double pieces_of(const std::vector<InstrumentSweep>& sweeps) {
  double most = 1;
  for (const InstrumentSweep& s : sweeps) {
    const double way_mm = std::max(padded(s.motion_mm(0)).norm(), padded(s.motion_mm(1)).norm());
    if (!s.to.is<Grasper>()) most = std::max(most, way_mm / (kPieceOfRadius * s.to.radius_mm));
  }
  return most;
}

// How stiffly each body's volume is kept: springs don't know of volume, elements resist its change
// by Poisson's ratio.
std::vector<double> kept_volumes(const DeformBodies& bodies, const DeformOptions& options) {
  std::vector<double> kept;
  for (const DeformBody& body : bodies)
    kept.push_back(options.solver == TissueSolver::fem ? 0 : body.mechanics.volume_stiffness);
  return kept;
}

}  // namespace

ShapeSolver::ShapeSolver(const DeformBodies& bodies, const DeformOptions& options)
    : options_(options),
      diagonal_mm_(largest_diagonal(bodies)),
      tissue_(make_tissue(bodies, options)),
      pressures_(*tissue_, {*tissue_, kept_volumes(bodies, options)}),
      skin_(*tissue_, bodies),
      search_(skin_, *tissue_),
      anchored_skin_(skin_, search_),
      constraints_(*tissue_, pressures_, options.friction) {
  for (const DeformBody& body : bodies) grasp_strength_n_.push_back(body.mechanics.grasp_slip_n);
  if (options.tissue_contacts) tissue_search_.emplace(skin_, *tissue_, search_, diagonal_mm_);
  force_.assign(tissue_->size(), PaddedVector::Zero());
  x_coasted_ = tissue_->rest();
  find_adrift(bodies);
  to_rest();
}

void ShapeSolver::find_adrift(const DeformBodies& bodies) {
  std::vector<Adrift> all(tissue_->pieces().size());
  for (std::uint32_t slot = 0; slot < tissue_->free_count(); ++slot)
    all[tissue_->piece_of_slot(slot)].slots.push_back(slot);
  for (std::size_t p = 0; p < all.size(); ++p) {
    const Tissue::Piece& piece = tissue_->pieces()[p];
    const double drag_per_s = bodies[piece.organ].mechanics.drag_per_s;
    if (piece.held || drag_per_s == 0) continue;
    all[p].kept = 1 / (1 + drag_per_s * options_.time_step_s);
    adrift_.push_back(std::move(all[p]));
  }
}

// Nothing but what lies round it takes its motion from a piece that is adrift: the wet cavity.
void ShapeSolver::slow_down() {
  const double fastest = kFastestAdrift * diagonal_mm_ / options_.time_step_s;
  for (const Adrift& piece : adrift_) {
    for (const std::uint32_t slot : piece.slots) {
      const double speed = velocity_[slot].norm();
      velocity_[slot] *= speed > fastest ? fastest / speed : piece.kept;
    }
  }
}

void ShapeSolver::to_rest() {
  x_ = x_start_ = x_free_ = x_before_ = tissue_->rest();
  velocity_.assign(tissue_->size(), PaddedVector::Zero());
  forget_touch();
}

void ShapeSolver::forget_touch() {
  contacts_.clear(), punctures_.clear();
  pressures_.reset();
  constraints_.forget_give();
  if (tissue_search_) tissue_search_->reset();
  last_energy_ = kUnknownEnergy;
}

bool ShapeSolver::held() const {
  return std::any_of(contacts_.begin(), contacts_.end(),
                     [](const Contact& c) { return c.lasts() || !c.force.isZero(0); });
}

bool ShapeSolver::tangled() const {
  return load_.empty() && tissue_->relaxed_at_rest() && held() &&
         std::all_of(contacts_.begin(), contacts_.end(), [this](const Contact& c) {
           if (c.of_tissue()) return !tissue_search_->parts_pieces(c);
           return !c.lasts() && c.force.isZero(0);
         });
}

void ShapeSolver::let_in(std::vector<InstrumentSweep>& sweeps) {
  closed_in_vain_ = 0;
  skin_.pose(x_);
  came_in_ = false;
  for (InstrumentSweep& sweep : sweeps) {
    if (!sweep.just_placed) continue;
    const Eigen::Vector3d way = search_.way_out(sweep.to);
    if (way.isZero(0)) continue;
    if (sweep.to.is<Grasper>()) {
      ++closed_in_vain_;
      continue;
    }
    sweep.from.position_mm += way;
    sweep.just_placed = false;
    came_in_ = true;
  }
}

void ShapeSolver::find_faces(const std::vector<InstrumentSweep>& sweeps) {
  Stopwatch watch;
  search_.find_faces(x_, sweeps);
  moved_since_found_mm_ = 0;
  collision_ms_ += watch.lap();
}

// Where skin meets tips and other skin, in the shape of now.
Penetration ShapeSolver::refresh(const std::vector<InstrumentSweep>& sweeps, double fraction) {
  Stopwatch watch;
  skin_.pose(x_);
  Penetration deepest;
  deepest.in_tips = search_.refresh(sweeps, fraction, contacts_);
  if (tissue_search_) deepest.in_tissue = tissue_search_->refresh(contacts_);
  collision_ms_ += watch.lap();
  return deepest;
}

void ShapeSolver::let_go(const std::vector<InstrumentSweep>& sweeps) {
  std::vector<std::uint32_t> go_on;  // in increasing order
  for (const InstrumentSweep& sweep : sweeps)
    if (!sweep.just_placed) go_on.push_back(sweep.instrument);
  std::erase_if(contacts_, [&](const Contact& c) {
    return !c.of_tissue() && !std::binary_search(go_on.begin(), go_on.end(), c.instrument);
  });
}

Penetration ShapeSolver::step(const std::vector<InstrumentSweep>& sweeps) {
  skin_.pose(x_);
  for (std::size_t s = 0; s < sweeps.size(); ++s) {
    if (sweeps[s].to.is<Grasper>() && sweeps[s].just_placed)
      closed_in_vain_ +=
          !close_grasper(sweeps[s], search_.faces_near(s), search_, skin_, contacts_);
  }
  close_jaws(options_.time_step_s, contacts_);
  for (Contact& c : contacts_) c.touched_at = 0;
  tip_too_fast_ = touched_on_the_way_ = false;
  if (tissue_search_) tissue_search_->begin_step();
  x_start_ = x_;
  constraints_.relax_give();
  for (std::size_t i = 0; i < tissue_->free_count(); ++i) {
    x_coasted_[i] = x_[i] + options_.time_step_s * velocity_[i];
  }
  slipped_ = 0;
  return any_carried(contacts_) ? pull(sweeps) : move(sweeps);
}

// Which grasper the tissue slips from in the shape of now.
std::optional<std::uint32_t> ShapeSolver::lost_grasp() const {
  if (!any_carried(contacts_)) return std::nullopt;
  if (pulled_too_far(contacts_, {x_, x_start_, tissue_->rest(), diagonal_mm_}))
    return most_loaded(contacts_);
  return overloaded(contacts_, *tissue_, grasp_strength_n_);
}

// A step with graspers. Jaws hold by friction: from one that pulls with more than that holds the
// tissue slips, and where it would have to follow them beyond any shape, because they are too far
// away or contradict each other, from the one that pulls the most. The step is then taken again
// from where it began.
Penetration ShapeSolver::pull(const std::vector<InstrumentSweep>& sweeps) {
  std::vector<Contact> before = contacts_;
  std::optional<TissueContacts::Sides> sides;
  if (tissue_search_) sides = tissue_search_->sides();
  Penetration deepest = move(sweeps);
  while (const auto slips = lost_grasp()) {
    std::erase_if(before,
                  [slips](const Contact& c) { return c.as<Carried>() && c.instrument == slips; });
    contacts_ = before;
    if (sides) tissue_search_->go_back_to(*sides);
    x_ = x_start_;
    pressures_.reset();
    tip_too_fast_ = touched_on_the_way_ = false;
    find_faces(sweeps);
    ++slipped_;
    deepest = move(sweeps);
  }
  return deepest;
}

Penetration ShapeSolver::move(const std::vector<InstrumentSweep>& sweeps) {
  pressures_.begin_step(x_start_);
  advance(sweeps);
  const Penetration deepest = close_gaps(sweeps);
  tip_too_fast_ = tip_too_fast_ || (touched_on_the_way_ && !tools_touch());
  punctures_ = let_needles_through(sweeps, contacts_);
  return deepest;
}

// Foresight may climb out of a valley that it ran through. Nothing feeds a body that no tip
// touches, so a step that ends with more energy is taken again without it.
void ShapeSolver::advance(const std::vector<InstrumentSweep>& sweeps) {
  const bool touched = held();
  solve(sweeps, true);
  if (touched || held()) {
    last_energy_ = kUnknownEnergy;
    return;
  }
  double now = energy();
  if (now > last_energy_) {
    x_ = x_start_;
    solve(sweeps, false);
    now = energy();
  }
  last_energy_ = now;
}

// Of the step's motion, the tissue, its volume and the load (µJ).
double ShapeSolver::energy() const {
  double sum = tissue_->energy(x_, x_start_) + pressures_.energy();
  for (std::size_t i = 0; i < load_.size(); ++i) sum -= load_[i].dot(x_[i] - tissue_->rest()[i]);
  return sum;
}

void ShapeSolver::set_load(const std::vector<Eigen::Vector3d>& force_n) {
  load_.clear();
  last_energy_ = kUnknownEnergy;
  if (force_n.empty()) return;
  load_.assign(tissue_->size(), PaddedVector::Zero());
  for (std::size_t v = 0; v < force_n.size(); ++v) {
    load_[tissue_->slot_of_vertex()[v]] = padded(kMilliNewtonPerNewton * force_n[v]);
  }
  tissue_->embedding().spread(load_);
  load_.resize(tissue_->free_count());  // what anchors bear moves nothing
}

void ShapeSolver::solve(const std::vector<InstrumentSweep>& sweeps, bool with_foresight) {
  for (int iteration = 0; iteration < options_.iterations; ++iteration) {
    const bool first = iteration == 0;
    x_before_ = x_;
    move_freely(first && with_foresight ? foreseen() : x_);
    if (first) {
      follow_sweeps(sweeps);
    } else if (moved_since_found_mm_ > ContactSearch::slack_mm(sweeps)) {
      find_faces(sweeps);
    }
    constrain(sweeps, 1);
    const double moved_mm = largest_distance(x_, x_before_);
    if (moved_mm < kConverged_mm) break;
    moved_since_found_mm_ += moved_mm;
  }
}

// One local and global step without contacts and volume, from the shape given to x_free_ (which may
// be the same).
void ShapeSolver::move_freely(const PaddedVectors& from) {
  tissue_->local_step(from, x_start_, x_coasted_, force_);
  for (std::size_t i = 0; i < load_.size(); ++i) force_[i] += load_[i];
  pressures_.solve_along(force_.data());
  for (std::size_t i = 0; i < tissue_->free_count(); ++i) x_free_[i] = from[i] + force_[i];
  tissue_->embedding().carry_positions(tissue_->rest(), x_free_);
}

// Where the first local step takes its directions from: on along the last step's motion. Far from
// converged (stiff springs, few iterations) the steps then act as a heavy-ball iteration (Polyak
// 1964), whose slow modes die out several times faster; converged steps don't depend on it.
const PaddedVectors& ShapeSolver::foreseen() {
  const double limit = kForesightLimit * diagonal_mm_;
  for (std::size_t i = 0; i < tissue_->free_count(); ++i) {
    const PaddedVector move = kForesight * options_.time_step_s * velocity_[i];
    const double length = move.norm();
    x_free_[i] = x_start_[i] + (length > limit ? limit / length : 1) * move;
  }
  return x_free_;
}

// A fast tip pushes the skin ahead of it piece by piece, so that it cannot end up behind.
void ShapeSolver::follow_sweeps(const std::vector<InstrumentSweep>& sweeps) {
  if (!search_.found_any()) return;
  const double wanted = pieces_of(sweeps);
  const int pieces = static_cast<int>(std::ceil(std::min<double>(wanted, kMostPieces)));
  if (wanted > kMostPieces) tip_too_fast_ = true;
  for (int piece = 1; piece < pieces; ++piece) {
    constrain(sweeps, double(piece) / pieces);
    touched_on_the_way_ = touched_on_the_way_ || (pieces > kFewPieces && tools_touch());
  }
}

bool ShapeSolver::tools_touch() const {
  return std::any_of(contacts_.begin(), contacts_.end(),
                     [](const Contact& c) { return !c.of_tissue(); });
}

// One pass of the constraints at a place of the tips; x becomes the shape that keeps them there.
void ShapeSolver::constrain(const std::vector<InstrumentSweep>& sweeps, double fraction) {
  refresh(sweeps, fraction);
  constraints_.solve(x_start_, x_free_, contacts_, x_);
}

// The shape is done; what its normals' turning has left between skin and tips is closed here.
Penetration ShapeSolver::close_gaps(const std::vector<InstrumentSweep>& sweeps) {
  find_faces(sweeps);
  Penetration deepest;
  for (int round = 0; round < kFinalRounds; ++round) {
    deepest = refresh(sweeps, 1);
    const bool closed = std::max(deepest.in_tips, deepest.in_tissue) < kContactWithin_mm;
    if (closed && pressures_.volume_error(x_) < kVolumeWithin) break;
    constraints_.solve(x_start_, x_free_, contacts_, x_);
  }
  return deepest;
}

double ShapeSolver::settle_motion() {
  // How long ago a tip came in that was first seen deep inside, nobody knows: tissue stands still.
  const double fastest = came_in_ ? 0 : kFastestPerStep * diagonal_mm_;
  for (std::size_t i = 0; i < tissue_->free_count(); ++i) {
    const PaddedVector move = x_[i] - x_start_[i];
    const double length = move.norm();
    velocity_[i] = (length > fastest ? fastest / length : 1) / options_.time_step_s * move;
  }
  slow_down();
  std::erase_if(contacts_, [](const Contact& c) { return !c.lasts() && c.force.isZero(0); });
  return largest_distance(x_, x_start_);
}

// Written so that NaN is lost, too.
bool ShapeSolver::lost() const { return !(farthest_from_rest() <= kRunaway * diagonal_mm_); }

void ShapeSolver::place(const std::vector<std::uint32_t>& slots,
                        const std::vector<Eigen::Vector3d>& at_mm) {
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (slots[i] >= tissue_->free_count()) continue;  // anchors stay
    x_[slots[i]] = padded(at_mm[i]);
    velocity_[slots[i]].setZero();
  }
  tissue_->embedding().carry_positions(tissue_->rest(), x_);
  forget_touch();
}

void ShapeSolver::continue_from(ShapeSolver& before, const std::vector<NodeSource>& sources,
                                const std::vector<Instrument>& instruments) {
  to_rest();
  for (std::size_t n = 0; n < sources.size(); ++n) {
    const std::uint32_t slot = tissue_->slot_of_node()[n];
    if (slot >= tissue_->free_count()) continue;  // anchors stay
    x_[slot].setZero(), velocity_[slot].setZero();
    for (std::size_t k = 0; k < 4; ++k) {
      const double weight = sources[n].weights[k];
      if (weight == 0) continue;
      const std::uint32_t was = before.tissue_->slot_of_node()[sources[n].nodes[k]];
      x_[slot] += weight * before.x_[was];
      velocity_[slot] += weight * before.velocity_[was];
    }
  }
  tissue_->embedding().carry_positions(tissue_->rest(), x_);
  constraints_.take_give(before.constraints_, x_);
  x_start_ = x_free_ = x_before_ = x_coasted_ = x_;
  const auto held =
      held_contacts(before.contacts_, before.skin_, before.tissue_->rest(), before.x_);
  hold_anew(held, instruments, search_, {skin_, x_}, contacts_);
}

}  // namespace organbake::deform
