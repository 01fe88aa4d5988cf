// SPDX-License-Identifier: Apache-2.0
// The public face of the solver: steps of tissue under instruments, in the units that callers use,
// with a report of forces and contacts. Tissue that has come to rest sleeps, and its steps then
// cost next to nothing and change no number.
#include "organbake/deform/deformer.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "contact/contact_search.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "solver/shape_solver.h"
#include "solver/state_tape.h"

namespace organbake {
namespace {

constexpr double kSnap_mm = 1e-4;       // nearer to rest and slower per step: at rest
constexpr double kStill_mm = 1e-6;      // a step that moves no vertex by more is still,
constexpr double kStillHeld_mm = 1e-4;  // or by so much under tips that don't move
constexpr double kLargestLoad_n = 1e9;
constexpr int kStillSteps = 16;  // so many in a row: asleep where it is
constexpr double kSoftTissuePoisson = 0.45;

// How an elastic half space of the tissue answers a stiff ball (Hertz 1882), mN/mm².
double half_space_mn_per_mm2(const MechanicsModel& mechanics) {
  const double nu = mechanics.body ? mechanics.body->poisson_ratio : kSoftTissuePoisson;
  return 4.0 / 3 * mechanics.young_modulus_kpa / (1 - nu * nu);
}

}  // namespace

struct Deformer::Impl {
  Impl(const DeformBodies& bodies, const DeformOptions& options)
      : solver(bodies, options.chosen_for(bodies)) {
    for (const DeformBody& body : bodies) {
      positions.insert(positions.end(), body.proxy.vertices.begin(), body.proxy.vertices.end());
      faces_up_to.push_back((faces_up_to.empty() ? 0 : faces_up_to.back()) +
                            body.proxy.faces.size());
      half_space.push_back(options.stiffness * half_space_mn_per_mm2(body.mechanics));
    }
    to_rest();
  }

  void continue_from(Impl& before, const std::vector<std::vector<NodeSource>>& sources,
                     bool rest_stays);
  void place(std::size_t organ, const std::vector<Eigen::Vector3d>& points_mm);
  std::vector<Eigen::Vector3d> contact_force_n() const;
  const StepReport& step(const std::vector<Instrument>& asked);
  void set_load(const std::vector<Eigen::Vector3d>& force_n);
  void to_rest();
  void finish_step(bool tips_unchanged);
  void rest_or_sleep(double largest_move_mm, bool tips_unchanged);
  void report_positions(const std::vector<Instrument>& tips);
  void report_forces();
  void find_walls(const std::vector<Instrument>& asked, const std::vector<Instrument>& tips);
  std::size_t organ_of_face(std::uint32_t face) const;
  ContactPoint contact_point(const deform::Contact& c) const;
  bool publish();

  template <class Self, class Tape>
  static void pass(Self& self, Tape& tape) {
    tape(self.held, self.report, self.still_steps, self.asleep, self.moved);
    deform::ShapeSolver::pass(self.solver, tape);
  }

  deform::ShapeSolver solver;
  std::vector<Instrument> held;            // where the last step held them
  std::vector<Eigen::Vector3d> positions;  // of the proxy's vertices, mm
  std::vector<std::size_t> faces_up_to;    // with each organ
  std::vector<double> half_space;          // of each organ's tissue
  std::vector<ContactPoint> walls;         // anchored skin that stopped probes in the last step,
  std::vector<deform::SkinPoint> at_wall;  // and where
  StepReport report;                       // of the last step that was computed
  int still_steps = 0;
  bool asleep = false;
  bool moved = false;
};

void Deformer::Impl::to_rest() {
  solver.to_rest();
  still_steps = 0;
  asleep = solver.relaxed_at_rest();
}

void Deformer::Impl::continue_from(Impl& before,
                                   const std::vector<std::vector<NodeSource>>& sources,
                                   bool rest_stays) {
  std::vector<NodeSource> all;
  std::vector<std::uint32_t> first(sources.size() + 1, 0);
  for (const std::uint32_t slot : before.solver.tissue().slot_of_node())
    ++first[before.solver.tissue().organ_of_slot()[slot] + 1];
  for (std::size_t organ = 0; organ < sources.size(); ++organ) {
    first[organ + 1] += first[organ];
    for (NodeSource source : sources[organ]) {
      for (std::uint32_t& node : source.nodes) node += first[organ];
      all.push_back(source);
    }
  }
  held = before.held;
  solver.continue_from(before.solver, all, held);
  report = before.report;
  asleep = false;
  if (rest_stays && before.asleep && !solver.held() && solver.farthest_from_rest() < kSnap_mm)
    to_rest();
  publish();
}

void Deformer::Impl::place(std::size_t organ, const std::vector<Eigen::Vector3d>& points_mm) {
  const deform::Tissue& tissue = solver.tissue();
  std::vector<std::uint32_t> slots =
      tissue.slot_of_node().empty() ? tissue.slot_of_vertex() : tissue.slot_of_node();
  std::erase_if(slots, [&](std::uint32_t s) { return tissue.organ_of_slot()[s] != organ; });
  if (slots.size() != points_mm.size()) {
    throw UsageError(std::to_string(points_mm.size()) + " places for the " +
                     std::to_string(slots.size()) + " points of an organ");
  }
  solver.place(slots, points_mm);
  held.clear();
  report = {};
  still_steps = 0;
  asleep = false;
  moved = publish();
}

std::vector<Eigen::Vector3d> Deformer::Impl::contact_force_n() const {
  const std::vector<std::uint32_t>& slot_of_vertex = solver.tissue().slot_of_vertex();
  deform::PaddedVectors on_slots(solver.tissue().size(), deform::PaddedVector::Zero());
  for (const deform::Contact& c : solver.contacts())
    if (!c.of_tissue() && !c.force.isZero(0)) deform::share_out_force(c, on_slots);
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const auto& [face, b1, b2, height] = at_wall[w];
    const double weights[] = {1 - b1 - b2, b1, b2};
    for (int k = 0; k < 3; ++k)
      on_slots[solver.tissue().faces()[face][k]] -=
          deform::kMilliNewtonPerNewton * weights[k] * deform::padded(walls[w].force_n);
  }
  std::vector<Eigen::Vector3d> on_vertices;
  for (const std::uint32_t slot : slot_of_vertex)
    on_vertices.emplace_back(on_slots[slot].head<3>() / deform::kMilliNewtonPerNewton);
  return on_vertices;
}

const StepReport& Deformer::Impl::step(const std::vector<Instrument>& asked) {
  check_instruments(asked);
  const std::vector<Instrument> tips = deform::moved_apart(held, asked, &solver.anchored_skin());
  find_walls(asked, tips);
  moved = false;
  const bool still = unchanged(held, tips);
  if (asleep && still) {
    report.tip_force_n.resize(tips.size(), Eigen::Vector3d::Zero());
    report_positions(tips);
    report.recovered = false;
    report.slipped = report.closed_in_vain = 0;
    report.punctures.clear();
    report.collision_ms = 0;
    return report;
  }
  const bool was_held = solver.held();
  std::vector<InstrumentSweep> sweeps = sweeps_between(held, tips);
  std::erase_if(sweeps, [](const InstrumentSweep& s) { return has_blade(s.to.kind); });
  solver.let_go(sweeps);
  solver.let_in(sweeps);
  held = tips;
  report = {};
  report.closed_in_vain = solver.closed_in_vain();
  report.tip_force_n.assign(tips.size(), Eigen::Vector3d::Zero());
  report_positions(tips);
  if (!solver.near_skin(sweeps) && asleep && !was_held) {
    report.collision_ms = solver.take_collision_ms();
    return report;
  }

  asleep = false;
  const deform::Penetration deepest = solver.step(sweeps);
  report.penetration_mm = deepest.in_tips;
  report.tissue_penetration_mm = deepest.in_tissue;
  report.tip_too_fast = solver.tip_too_fast();
  report.slipped = solver.slipped();
  report.closed_in_vain = solver.closed_in_vain();
  finish_step(still);
  report.collision_ms = solver.take_collision_ms();
  return report;
}

void Deformer::Impl::set_load(const std::vector<Eigen::Vector3d>& force_n) {
  if (!force_n.empty() && force_n.size() != positions.size()) {
    throw UsageError("a load of " + std::to_string(force_n.size()) + " forces for " +
                     std::to_string(positions.size()) + " proxy vertices");
  }
  for (std::size_t v = 0; v < force_n.size(); ++v) {
    if (!(force_n[v].norm() <= kLargestLoad_n)) {  // NaN fails it, too
      throw UsageError("the load on vertex " + std::to_string(v) + " is not a force up to 1e9 N");
    }
  }
  solver.set_load(force_n);
  still_steps = 0;
  asleep = false;
}

void Deformer::Impl::finish_step(bool tips_unchanged) {
  if (solver.lost()) {
    to_rest();
    held.clear();
    report.recovered = true;
    report.penetration_mm = report.tissue_penetration_mm = 0;
  } else {
    report_forces();
    rest_or_sleep(solver.settle_motion(), tips_unchanged);
  }
  moved = publish();
}

void Deformer::Impl::report_positions(const std::vector<Instrument>& tips) {
  report.tool_contacts = deform::count_touching(tips);
  report.tip_position_mm.clear();
  for (const Instrument& tip : tips) report.tip_position_mm.push_back(tip.position_mm);
}

void Deformer::Impl::report_forces() {
  for (const deform::Contact& c : solver.punctures()) report.punctures.push_back(contact_point(c));
  for (const deform::Contact& c : solver.contacts()) {
    if (c.force.isZero(0)) continue;
    ++(c.of_tissue() ? report.tissue_contacts : report.contacts);
    if (c.of_tissue()) continue;
    report.contact_points.push_back(contact_point(c));
    report.tip_force_n[c.instrument] += report.contact_points.back().force_n;
  }
}

ContactPoint Deformer::Impl::contact_point(const deform::Contact& c) const {
  ContactPoint point;
  point.instrument = c.instrument;
  point.organ = organ_of_face(c.at.face);
  point.position_mm = c.point.head<3>();
  point.carried = c.as<deform::Carried>() != nullptr;
  // What the lever makes of it on the points that give way: Σ of their weights is 1/φ.
  const double on_points = 1 / c.response.free_share;
  point.force_n = -on_points / deform::kMilliNewtonPerNewton * c.force.head<3>();
  const deform::PaddedVector pushed = c.point - c.anchored_at;
  if (c.lasts()) {
    point.normal = point.force_n.normalized();
    point.depth_mm = pushed.norm();
  } else {
    point.normal = -c.normal.head<3>();
    point.depth_mm = pushed.dot(c.normal);
  }
  return point;
}

std::size_t Deformer::Impl::organ_of_face(std::uint32_t face) const {
  return static_cast<std::size_t>(std::upper_bound(faces_up_to.begin(), faces_up_to.end(), face) -
                                  faces_up_to.begin());
}

// Anchored skin pushes back as an elastic half space would that is pressed in as far as the probe
// was stopped short of where it was asked for.
void Deformer::Impl::find_walls(const std::vector<Instrument>& asked,
                                const std::vector<Instrument>& tips) {
  walls.clear(), at_wall.clear();
  for (const auto& [instrument, hit, outward] : solver.anchored_skin().touches()) {
    const Instrument& tip = tips[instrument];
    const double pressed_mm =
        std::max(0.0, (tip.position_mm - asked[instrument].position_mm).dot(outward));
    ContactPoint point;
    point.instrument = instrument;
    point.organ = organ_of_face(hit.at.face);
    point.position_mm = hit.point.head<3>();
    point.normal = outward;
    point.force_n = half_space[point.organ] * std::sqrt(tip.radius_mm) * std::pow(pressed_mm, 1.5) /
                    deform::kMilliNewtonPerNewton * outward;
    walls.push_back(point);
    at_wall.push_back(hit.at);
  }
}

void Deformer::Impl::rest_or_sleep(double largest_move_mm, bool tips_unchanged) {
  const bool held = solver.held();
  if (!held && solver.relaxed_at_rest() && largest_move_mm < kSnap_mm &&
      solver.farthest_from_rest() < kSnap_mm) {
    return to_rest();
  }
  const bool still =
      held ? tips_unchanged && largest_move_mm < kStillHeld_mm : largest_move_mm < kStill_mm;
  still_steps = still ? still_steps + 1 : 0;
  if (still_steps < kStillSteps) return;
  // Nothing holds tissue away from its rest but a fold that caught on itself.
  if (solver.tangled()) {
    solver.untangle();
    still_steps = 0;
  } else {
    asleep = true;
  }
}

bool Deformer::Impl::publish() {
  bool changed = false;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const Eigen::Vector3d now = solver.shape()[solver.tissue().slot_of_vertex()[v]].head<3>();
    changed = changed || now != positions[v];
    positions[v] = now;
  }
  return changed;
}

Deformer::Deformer(const TriangleMesh& proxy, const MechanicsModel& mechanics,
                   const BaseLayer& base, const DeformOptions& options)
    : Deformer({{proxy, mechanics, base}}, options) {}
Deformer::Deformer(const DeformBodies& bodies, const DeformOptions& options)
    : impl_(std::make_unique<Impl>(bodies, options)) {}
Deformer::~Deformer() = default;
Deformer::Deformer(Deformer&&) noexcept = default;
Deformer& Deformer::operator=(Deformer&&) noexcept = default;

StepReport Deformer::step(const std::vector<Instrument>& instruments) {
  StepReport report = impl_->step(instruments);
  for (const ContactPoint& wall : impl_->walls) {
    ++report.contacts;
    report.contact_points.push_back(wall);
    report.tip_force_n[wall.instrument] += wall.force_n;
  }
  return report;
}
void Deformer::set_load(const std::vector<Eigen::Vector3d>& force_n) { impl_->set_load(force_n); }
const std::vector<Eigen::Vector3d>& Deformer::positions() const { return impl_->positions; }
std::vector<Eigen::Vector3d> Deformer::node_positions(std::size_t organ) const {
  std::vector<Eigen::Vector3d> positions;
  for (const std::uint32_t slot : impl_->solver.tissue().slot_of_node()) {
    if (impl_->solver.tissue().organ_of_slot()[slot] == organ)
      positions.push_back(impl_->solver.shape()[slot].head<3>());
  }
  return positions;
}
void Deformer::continue_from(Deformer& before, const std::vector<std::vector<NodeSource>>& sources,
                             bool rest_stays) {
  impl_->continue_from(*before.impl_, sources, rest_stays);
}
void Deformer::place(std::size_t organ, const std::vector<Eigen::Vector3d>& points_mm) {
  impl_->place(organ, points_mm);
}
std::vector<Eigen::Vector3d> Deformer::contact_force_n() const { return impl_->contact_force_n(); }
std::vector<Grip> Deformer::grips() const {
  std::vector<Grip> grips;
  for (const deform::Contact& c : impl_->solver.contacts())
    if (const auto* held = c.as<deform::Carried>();
        held && (grips.empty() || grips.back().instrument != c.instrument))
      grips.push_back({c.instrument, c.point.head<3>(), c.normal.head<3>(), held->closed});
  return grips;
}
bool Deformer::moved() const { return impl_->moved; }

std::size_t Deformer::State::bytes_beside(const State& other) const {
  if (!tape_) return 0;
  std::size_t bytes = sizeof(Tape) + tape_->other_bytes;
  for (std::size_t p = 0; p < tape_->pieces.size(); ++p) {
    const bool shared =
        other.tape_ && p < other.tape_->pieces.size() && tape_->pieces[p] == other.tape_->pieces[p];
    bytes += sizeof(Tape::Piece) + (shared ? 0 : tape_->pieces[p]->size());
  }
  return bytes;
}

Deformer::State Deformer::save_state(const State& earlier) const {
  const auto tape = std::make_shared<State::Tape>();
  deform::StateWriter writer(*tape, earlier.tape_.get());
  Impl::pass(std::as_const(*impl_), writer);
  State state;
  state.tape_ = tape;
  return state;
}

void Deformer::restore_state(const State& state) {
  deform::StateReturner returner(*state.tape_);
  Impl::pass(*impl_, returner);
  impl_->solver.be_restored();
  const bool moved = impl_->moved;
  impl_->publish();
  impl_->moved = moved;
}

void Deformer::reset() {
  impl_->to_rest();
  impl_->held.clear();
  impl_->report = {};
  impl_->moved = impl_->publish();
}

}  // namespace organbake
