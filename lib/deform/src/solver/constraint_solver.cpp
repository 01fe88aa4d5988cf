// SPDX-License-Identifier: Apache-2.0
// Solves for contact forces and pressures by projected Gauss–Seidel: gathers what the contacts ask,
// couples them through columns of the inverse matrix, sweeps until forces settle within Coulomb's
// cones, and moves the shape by them.
#include "solver/shape_solver.h"

#include <algorithm>
#include <cmath>

namespace organbake::deform {
namespace {

constexpr std::uint32_t kAbsent = 0xFFFFFFFFu;
constexpr std::size_t kCacheBytes = std::size_t{64} << 20;
constexpr std::size_t kFewest = 512;  // more than the vertices of all contacts of a few tips

}  // namespace

ComplianceColumns::ComplianceColumns(const Tissue& tissue)
    : tissue_(tissue),
      capacity_(std::max(kFewest, kCacheBytes / (sizeof(double) * (tissue.moving_count() + 1)))),
      place_of_slot_(tissue.moving_count(), kAbsent),
      scratch_(tissue.moving_count()) {}

void ComplianceColumns::require(const std::vector<std::uint32_t>& slots) {
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t slot : slots) {
    if (place_of_slot_[slot] == kAbsent) missing.push_back(slot);
  }
  if (missing.empty()) return;
  if (columns_.size() + missing.size() > capacity_) {
    columns_.clear();
    std::fill(place_of_slot_.begin(), place_of_slot_.end(), kAbsent);
    missing = slots;
  }
  for (std::size_t i = 0; i < missing.size(); i += 4) {
    make(missing.data() + i, std::min<std::size_t>(4, missing.size() - i));
  }
}

void ComplianceColumns::make(const std::uint32_t* slots, std::size_t count) {
  std::fill(scratch_.begin(), scratch_.end(), PaddedVector::Zero());
  for (std::size_t lane = 0; lane < count; ++lane) put(slots[lane], 1, lane);
  solve();
  for (std::size_t lane = 0; lane < count; ++lane) {
    place_of_slot_[slots[lane]] = static_cast<std::uint32_t>(columns_.size());
    read(lane, columns_.emplace_back());
  }
}

void ComplianceColumns::make(std::span<CarrierResponse* const> responses) {
  std::fill(scratch_.begin(), scratch_.end(), PaddedVector::Zero());
  for (std::size_t lane = 0; lane < responses.size(); ++lane) {
    for (const auto& [slot, weight] : responses[lane]->carriers)
      put(slot, responses[lane]->scale * weight, lane);
  }
  solve();
  for (std::size_t lane = 0; lane < responses.size(); ++lane) {
    std::vector<double> column;
    read(lane, column);
    responses[lane]->column = std::make_shared<const std::vector<double>>(std::move(column));
  }
}

// Adds a force on a slot to the right side in a lane.
void ComplianceColumns::put(std::uint32_t slot, double weight, std::size_t lane) {
  const auto column = static_cast<Eigen::Index>(lane);
  if (slot < tissue_.free_count()) {
    scratch_[slot][column] += weight;
  } else {
    tissue_.embedding().spread_force(slot, weight, column, scratch_);
  }
}

void ComplianceColumns::solve() {
  tissue_.factor().solve(scratch_.data());
  tissue_.embedding().carry(scratch_);
}

void ComplianceColumns::read(std::size_t lane, std::vector<double>& column) const {
  column.resize(scratch_.size());
  for (std::size_t i = 0; i < column.size(); ++i)
    column[i] = scratch_[i][static_cast<Eigen::Index>(lane)];
}

namespace {

constexpr int kMaxSweeps = 60;
constexpr double kSettled_mm = 2e-4;  // largest change of a sweep, far below a contact's tolerance
// Relative give: a constraint is missed by this share of the displacement that its force makes. It
// bounds the forces where graspers contradict each other. A contact may give far less, because what
// friction gives in one step is never taken back: skin would creep under a tip that holds still.
constexpr double kGrasperGive = 1e-3;
constexpr double kContactGive = 1e-5;

// Coulomb: no pull, and no more friction than the push allows.
Double4 into_cone(const Double4& force, const Double4& normal, double friction) {
  const double along = dot(force, normal);
  if (!(along > 0)) return Double4{};
  const Double4 across = force - along * normal;
  const double squared = dot(across, across), limit = friction * along;
  if (!(squared > limit * limit)) return along * normal + across;
  return along * normal + limit / std::sqrt(squared) * across;
}

// The force with its part along a needle's shaft limited to what friction holds.
Double4 along_shaft(const Double4& force, const Double4& shaft, double most) {
  const double along = dot(force, shaft);
  return force - (along - std::clamp(along, -most, most)) * shaft;
}

}  // namespace

ConstraintSolver::ConstraintSolver(const Tissue& tissue, BodyPressures& pressures, double friction)
    : tissue_(tissue),
      pressures_(pressures),
      friction_(friction),
      columns_(tissue),
      given_(tissue.give().none()),
      relaxed_(given_),
      give_by_place_(given_.size(), 0.0) {}

void ConstraintSolver::solve(const PaddedVectors& x_start, const PaddedVectors& x_free,
                             std::vector<Contact>& contacts, PaddedVectors& x) {
  complete_carriers(contacts);
  gather(x_start, x_free, contacts);
  couple();
  if (!pressures_.none()) pressures_.measure_gaps(x_free, x);
  iterate(contacts);
  apply(x_free, x);
  give_way(x);
}

void ConstraintSolver::complete_carriers(std::vector<Contact>& contacts) {
  std::vector<CarrierResponse*> missing;
  for (Contact& c : contacts)
    if (Carried* carried = c.as<Carried>(); carried && !carried->response.column)
      missing.push_back(&carried->response);
  for (std::size_t i = 0; i < missing.size(); i += 4)
    columns_.make(std::span(missing).subspan(i, std::min<std::size_t>(4, missing.size() - i)));
}

void ConstraintSolver::gather(const PaddedVectors& x_start, const PaddedVectors& x_free,
                              const std::vector<Contact>& contacts) {
  slots_.clear();
  parts_.clear();
  give_.clear();
  unknowns_.clear();
  for (const Contact& c : contacts) {
    Unknown u{};
    u.free_point = constrained_point(c, x_free, tissue_.rest());
    u.aim = aim_of(c, x_start);
    add_parts(c, u);
    add_give(u);
    u.kept = 1 / (1 + (c.as<Carried>() ? kGrasperGive : kContactGive));
    unknowns_.push_back(u);
  }
  std::sort(slots_.begin(), slots_.end());
  slots_.erase(std::unique(slots_.begin(), slots_.end()), slots_.end());
  for (Part& part : parts_) {
    part.local = static_cast<std::uint32_t>(
        std::lower_bound(slots_.begin(), slots_.end(), part.slot) - slots_.begin());
  }
  columns_.require(slots_);
}

// The one of the last parts, from `first` on, that is of a slot; made where there is none.
ConstraintSolver::Part& ConstraintSolver::part_of(std::uint32_t slot, std::uint32_t first,
                                                  std::vector<Part>& parts) {
  const auto known = std::find_if(parts.begin() + first, parts.end(),
                                  [slot](const Part& part) { return part.slot == slot; });
  return known == parts.end() ? parts.emplace_back(Part{slot}) : *known;
}

void ConstraintSolver::add_parts(const Contact& c, Unknown& u) {
  u.first = static_cast<std::uint32_t>(parts_.size());
  u.lopsided = !c.movers.empty();
  if (const Carried* carried = c.as<Carried>()) {
    u.column = carried->response.column->data();
    const double scale = carried->response.scale;
    for (const auto& [slot, weight] : carried->response.carriers)
      parts_.push_back({slot, 0, scale * weight, scale * weight});
  } else {
    for (int k = 0; k < c.response.count; ++k) {
      const double weight = c.response.weights[k];
      parts_.push_back({c.response.slots[k], 0, weight, u.lopsided ? 0 : weight});
      if (weight != 0) slots_.push_back(c.response.slots[k]);
    }
    for (const auto& [slot, weight] : c.movers)
      if (slot < tissue_.moving_count()) part_of(slot, u.first, parts_).moves = weight;
  }
  u.end = static_cast<std::uint32_t>(parts_.size());
  if (c.of_tissue()) {  // two sides, three vertices each
    add_side(u, u.first, u.first + 3);
    add_side(u, u.first + 3, u.end);
  } else {
    add_side(u, u.first, u.end);
  }
}

// What moves its point beyond the slots that carry it, and what of that is there without any force.
void ConstraintSolver::add_give(Unknown& u) {
  u.first_give = static_cast<std::uint32_t>(give_.size());
  for (std::uint32_t k = u.first; k < u.end; ++k) {
    for (const auto& [place, share] : tissue_.give().places_of(parts_[k].slot)) {
      const double weight = parts_[k].weight * share, moves = parts_[k].moves * share;
      if ((weight == 0 && moves == 0) || tissue_.give().mm_per_mn(place) == 0) continue;
      u.free_point += moves * relaxed_[place];
      Part& give = part_of(place, u.first_give, give_);
      give.weight += weight, give.moves += moves;
    }
  }
  u.end_give = static_cast<std::uint32_t>(give_.size());
}

// Where a grasper carries it; else on the tip or the needle, and there where friction holds it.
PaddedVector ConstraintSolver::aim_of(const Contact& c, const PaddedVectors& x_start) const {
  if (c.as<Carried>()) return c.target;
  const PaddedVector stuck = constrained_point(c, x_start, tissue_.rest()) + c.tip_motion;
  if (c.as<OnNeedle>()) return c.target + up_needle(c, stuck) * c.normal;
  return stuck - c.normal.dot(stuck - c.target) * c.normal;
}

// What the pressure in the body of some of its parts does to them and to the constrained point.
void ConstraintSolver::add_side(Unknown& u, std::uint32_t first, std::uint32_t end) const {
  if (first == end) return;
  const std::uint32_t body = pressures_.body_of_slot(parts_[first].slot);
  if (body == EnclosedVolume::kNoBody) return;
  Side& side = u.sides[u.side_count++];
  side = {body, PaddedVector::Zero(), PaddedVector::Zero()};
  for (std::uint32_t k = first; k < end; ++k) {
    const auto& [slot, local, weight, moves] = parts_[k];
    if (weight != 0) side.volume_move += weight * pressures_.move_of(slot);
    if (moves != 0) side.point_move += moves * pressures_.move_of(slot);
  }
}

void ConstraintSolver::couple() {
  const std::size_t n = unknowns_.size();
  coupling_.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const Unknown& u = unknowns_[i];
    for (std::size_t j = 0; j < i; ++j)
      if (mirrored(i, j)) coupling_[j * n + i] = coupling_[i * n + j];
    if (u.column) add_coupling(i, 1, u.column);
    for (std::uint32_t k = u.first; k < u.end && !u.column; ++k) {
      if (parts_[k].weight != 0) add_coupling(i, parts_[k].weight, columns_.column(parts_[k].slot));
    }
    couple_give(i);
    unknowns_[i].own = coupling_[i * n + i];
    unknowns_[i].per_own = unknowns_[i].own > 0 ? 1 / unknowns_[i].own : 0;
  }
}

// What a force on a contact that moves the slots as `column` tells does to the contacts' points,
// but to those whose forces move this one as far: couple() copies theirs.
void ConstraintSolver::add_coupling(std::size_t i, double force, const double* column) {
  const std::size_t n = unknowns_.size();
  for (std::size_t j = 0; j < n; ++j) {
    if (mirrored(i, j)) continue;
    double sum = 0;
    for (std::uint32_t l = unknowns_[j].first; l < unknowns_[j].end; ++l) {
      if (parts_[l].moves != 0) sum += parts_[l].moves * column[parts_[l].slot];
    }
    coupling_[j * n + i] += force * sum;
  }
}

// What a force on a contact moves the same points by the skin's giving way.
void ConstraintSolver::couple_give(std::size_t i) {
  const std::size_t n = unknowns_.size();
  const Unknown& u = unknowns_[i];
  if (u.first_give == u.end_give) return;
  for (std::uint32_t k = u.first_give; k < u.end_give; ++k)
    give_by_place_[give_[k].slot] = tissue_.give().mm_per_mn(give_[k].slot) * give_[k].weight;
  for (std::size_t j = 0; j < n; ++j)
    for (std::uint32_t l = unknowns_[j].first_give; l < unknowns_[j].end_give && !mirrored(i, j);
         ++l)
      coupling_[j * n + i] += give_by_place_[give_[l].slot] * give_[l].moves;
  for (std::uint32_t k = u.first_give; k < u.end_give; ++k) give_by_place_[give_[k].slot] = 0;
}

void ConstraintSolver::iterate(std::vector<Contact>& contacts) {
  force_.resize(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) force_[i] = contacts[i].force;
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    const double moved = sweep_pressures();
    if (std::max(moved, sweep_contacts(contacts)) < kSettled_mm) break;
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) contacts[i].force = force_[i];
}

// Each returns the largest displacement (mm) that its change of a force makes at its own point.
double ConstraintSolver::sweep_contacts(const std::vector<Contact>& contacts) {
  const std::size_t n = unknowns_.size();
  Double4* force = as_double4(force_.data());
  double largest = 0;  // squared
  for (std::size_t i = 0; i < n; ++i) {
    const Unknown& u = unknowns_[i];
    const Contact& c = contacts[i];
    if (u.per_own == 0) continue;
    const double* coupling = coupling_.data() + i * n;
    Double4 point = *as_double4(&u.free_point);
    for (std::size_t j = 0; j < n; ++j) point += coupling[j] * force[j];
    for (int s = 0; s < u.side_count; ++s)
      point += pressures_.pressure(u.sides[s].body) * *as_double4(&u.sides[s].point_move);

    Double4 next = force[i] - u.per_own * (point - *as_double4(&u.aim));
    if (const OnNeedle* on_needle = c.as<OnNeedle>()) {
      next = along_shaft(next, *as_double4(&c.normal), on_needle->most_friction_mn);
    } else if (!c.as<Carried>()) {  // wet skin slides on skin
      next = into_cone(next, *as_double4(&c.normal), c.of_tissue() ? 0 : friction_);
    }
    next *= u.kept;
    const Double4 moved = u.own * (next - force[i]);
    largest = std::max(largest, dot(moved, moved));
    force[i] = next;
  }
  return std::sqrt(largest);
}

double ConstraintSolver::sweep_pressures() {
  double largest = 0;
  for (std::uint32_t b = 0; b < pressures_.count(); ++b) {
    if (!pressures_.acts(b)) continue;
    double gap = pressures_.gap(b);
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      for (int s = 0; s < unknowns_[i].side_count; ++s) {
        const Side& side = unknowns_[i].sides[s];
        if (side.body == b) gap -= side.volume_move.dot(force_[i]);
      }
    }
    const double change = pressures_.close(b, gap);
    for (const Unknown& u : unknowns_) {
      for (int s = 0; s < u.side_count; ++s) {
        if (u.sides[s].body == b)
          largest = std::max(largest, std::abs(change) * u.sides[s].point_move.norm());
      }
    }
  }
  return largest;
}

void ConstraintSolver::apply(const PaddedVectors& x_free, PaddedVectors& x) const {
  PaddedVectors force(slots_.size(), PaddedVector::Zero());
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    const Unknown& u = unknowns_[i];
    for (std::uint32_t k = u.first; k < u.end && !u.column; ++k) {
      if (parts_[k].weight != 0) force[parts_[k].local] += parts_[k].weight * force_[i];
    }
  }
  pressures_.move(x_free, x);
  const std::size_t moving = tissue_.moving_count();
  Double4* to = as_double4(x.data());
  const auto add = [&](const double* column, const PaddedVector& by) {
    const Double4 f = *as_double4(&by);
    for (std::size_t i = 0; i < moving; ++i) to[i] += column[i] * f;
  };
  for (std::size_t s = 0; s < slots_.size(); ++s) add(columns_.column(slots_[s]), force[s]);
  for (std::size_t i = 0; i < unknowns_.size(); ++i)
    if (unknowns_[i].column) add(unknowns_[i].column, force_[i]);
}

void ConstraintSolver::give_way(PaddedVectors& x) {
  given_ = relaxed_;
  for (std::size_t i = 0; i < unknowns_.size(); ++i)
    for (std::uint32_t k = unknowns_[i].first_give; k < unknowns_[i].end_give; ++k)
      given_[give_[k].slot] +=
          tissue_.give().mm_per_mn(give_[k].slot) * give_[k].weight * force_[i];
  tissue_.give().move_points(given_, x);
}

}  // namespace organbake::deform
