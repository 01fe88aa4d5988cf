// SPDX-License-Identifier: Apache-2.0
#include "solver/constraint_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace organbake::deform {
namespace {

constexpr int kMaxSweeps = 60;
constexpr double kSettled_mm = 2e-4;  // largest change of a sweep, far below a contact's tolerance
// Relative give: a constraint is missed by this share of the displacement that its force makes. It
// bounds the forces where graspers contradict each other. A contact may give far less, because what
// friction gives in one step is never taken back: skin would creep under a tip that holds still.
constexpr double kGrasperGive = 1e-3;
constexpr double kContactGive = 1e-5;
// A pressure that moves nothing (flat or anchored skin) is left alone below this softness.
constexpr double kNoSoftness = 1e-300;
// Of a body's size: the volume is linearised about the shape that a step starts from, and a
// pressure that moves its skin farther than this tells nothing of the volume there. Taken at its
// word it may swell the body, be answered by a larger one in the next round, and so on without end.
// What is left is for the next steps.
constexpr double kLinearWithin = 0.5;

// Coulomb: no pull, and no more friction than the push allows.
Double4 into_cone(const Double4& force, const Double4& normal, double friction) {
  const double along = dot(force, normal);
  if (!(along > 0)) return Double4{};
  const Double4 across = force - along * normal;
  const double squared = dot(across, across), limit = friction * along;
  if (!(squared > limit * limit)) return along * normal + across;
  return along * normal + limit / std::sqrt(squared) * across;
}

// Along a needle's shaft no more than friction.
Double4 along_shaft(const Double4& force, const Double4& shaft, double most) {
  const double along = dot(force, shaft);
  return force - (along - std::clamp(along, -most, most)) * shaft;
}

}  // namespace

ConstraintSolver::ConstraintSolver(const Tissue& tissue, const EnclosedVolume& volume,
                                   double friction)
    : tissue_(tissue),
      volume_(volume),
      friction_(friction),
      columns_(tissue),
      gradient_(tissue.size(), PaddedVector::Zero()),
      response_(tissue.size(), PaddedVector::Zero()),
      pressure_(volume.bodies().size(), 0.0),
      softness_(volume.bodies().size(), 0.0),
      most_pressure_(volume.bodies().size(), 0.0),
      volume_gap_(volume.bodies().size(), 0.0),
      given_(tissue.give().none()),
      relaxed_(given_),
      give_by_place_(given_.size(), 0.0) {}

void ConstraintSolver::reset() { std::fill(pressure_.begin(), pressure_.end(), 0.0); }

void ConstraintSolver::begin_step(const PaddedVectors& x_start) {
  if (pressure_.empty()) return;
  volume_.gradient(x_start, gradient_);
  response_ = gradient_;
  response_due_ = true;
}

void ConstraintSolver::solve_along(PaddedVector* rows) {
  if (!response_due_) return tissue_.factor().solve_points(rows);
  tissue_.factor().solve_points(rows, response_.data());
  response_due_ = false;
  measure_softness();
}

void ConstraintSolver::measure_softness() {
  for (std::size_t b = 0; b < softness_.size(); ++b) softness_[b] = volume_.bodies()[b].compliance;
  std::fill(most_pressure_.begin(), most_pressure_.end(), 0.0);
  for (std::uint32_t i = 0; i < tissue_.free_count(); ++i) {
    const std::uint32_t body = volume_.body_of_slot(i);
    if (body == EnclosedVolume::kNoBody) continue;
    softness_[body] += gradient_[i].dot(response_[i]);
    most_pressure_[body] = std::max(most_pressure_[body], response_[i].squaredNorm());
  }
  for (std::size_t b = 0; b < softness_.size(); ++b) {
    const double farthest = std::sqrt(most_pressure_[b]);  // mm per unit of pressure
    const double size_mm = std::cbrt(std::abs(volume_.bodies()[b].rest_mm3));
    most_pressure_[b] =
        farthest > 0 ? kLinearWithin * size_mm / farthest : std::numeric_limits<double>::infinity();
  }
}

void ConstraintSolver::solve(const PaddedVectors& x_start, const PaddedVectors& x_free,
                             std::vector<Contact>& contacts, PaddedVectors& x) {
  complete_carriers(contacts);
  gather(x_start, x_free, contacts);
  couple();
  if (!pressure_.empty()) measure_volume_gap(x_free, x);
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

void ConstraintSolver::add_parts(const Contact& c, Unknown& u) {
  u.first = static_cast<std::uint32_t>(parts_.size());
  if (const Carried* carried = c.as<Carried>()) {
    u.column = carried->response.column->data();
    for (const auto& [slot, weight] : carried->response.carriers)
      parts_.push_back({slot, 0, carried->response.scale * weight});
  } else {
    for (int k = 0; k < c.response.count; ++k) {
      parts_.push_back({c.response.slots[k], 0, c.response.weights[k]});
      if (c.response.weights[k] != 0) slots_.push_back(c.response.slots[k]);
    }
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
      const double weight = parts_[k].weight * share;
      if (weight == 0 || tissue_.give().mm_per_mn(place) == 0) continue;
      u.free_point += weight * relaxed_[place];
      const auto known =
          std::find_if(give_.begin() + u.first_give, give_.end(),
                       [wanted = place](const Carrier& c) { return c.slot == wanted; });
      if (known == give_.end()) {
        give_.push_back({place, weight});
      } else {
        known->weight += weight;
      }
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

// What the pressure in the body of some of its parts does to the constrained point.
void ConstraintSolver::add_side(Unknown& u, std::uint32_t first, std::uint32_t end) const {
  if (first == end) return;
  const std::uint32_t body = volume_.body_of_slot(parts_[first].slot);
  if (body == EnclosedVolume::kNoBody) return;
  Side& side = u.sides[u.side_count++];
  side = {body, PaddedVector::Zero()};
  for (std::uint32_t k = first; k < end; ++k) {
    const auto& [slot, local, weight] = parts_[k];
    if (weight != 0) side.volume_move += weight * response_[slot];
  }
}

void ConstraintSolver::couple() {
  const std::size_t n = unknowns_.size();
  coupling_.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const Unknown& u = unknowns_[i];
    if (u.column) add_coupling(i, 1, u.column);
    for (std::uint32_t k = u.first; k < u.end && !u.column; ++k) {
      if (parts_[k].weight != 0) add_coupling(i, parts_[k].weight, columns_.column(parts_[k].slot));
    }
    couple_give(i);
    for (std::size_t j = i; j < n; ++j) coupling_[j * n + i] = coupling_[i * n + j];
    unknowns_[i].own = coupling_[i * n + i];
    unknowns_[i].per_own = unknowns_[i].own > 0 ? 1 / unknowns_[i].own : 0;
  }
}

// What a force that moves the slots as `column` tells does to a contact's point and later ones.
void ConstraintSolver::add_coupling(std::size_t i, double force, const double* column) {
  const std::size_t n = unknowns_.size();
  for (std::size_t j = i; j < n; ++j) {
    double sum = 0;
    for (std::uint32_t l = unknowns_[j].first; l < unknowns_[j].end; ++l) {
      if (parts_[l].weight != 0) sum += parts_[l].weight * column[parts_[l].slot];
    }
    coupling_[i * n + j] += force * sum;
  }
}

// What a force on a contact moves its own point and later ones by the skin's giving way.
void ConstraintSolver::couple_give(std::size_t i) {
  const std::size_t n = unknowns_.size();
  const Unknown& u = unknowns_[i];
  if (u.first_give == u.end_give) return;
  for (std::uint32_t k = u.first_give; k < u.end_give; ++k)
    give_by_place_[give_[k].slot] = tissue_.give().mm_per_mn(give_[k].slot) * give_[k].weight;
  for (std::size_t j = i; j < n; ++j)
    for (std::uint32_t l = unknowns_[j].first_give; l < unknowns_[j].end_give; ++l)
      coupling_[i * n + j] += give_by_place_[give_[l].slot] * give_[l].weight;
  for (std::uint32_t k = u.first_give; k < u.end_give; ++k) give_by_place_[give_[k].slot] = 0;
}

void ConstraintSolver::measure_volume_gap(const PaddedVectors& x_free, const PaddedVectors& x) {
  volume_.measure(x, volumes_);
  for (std::size_t b = 0; b < volumes_.size(); ++b) {
    volume_gap_[b] = volume_.bodies()[b].rest_mm3 - volumes_[b];
  }
  const Double4* gradient = as_double4(gradient_.data());
  const Double4* free = as_double4(x_free.data());
  const Double4* at = as_double4(x.data());
  const auto count = static_cast<std::uint32_t>(tissue_.free_count());
  for (std::uint32_t i = 0; i < count;) {  // by runs of one body
    const std::uint32_t body = volume_.body_of_slot(i);
    Double4 products{};
    for (; i < count && volume_.body_of_slot(i) == body; ++i)
      products += gradient[i] * (free[i] - at[i]);
    if (body != EnclosedVolume::kNoBody)
      volume_gap_[body] -= products[0] + products[1] + products[2];
  }
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
      point += pressure_[u.sides[s].body] * *as_double4(&u.sides[s].volume_move);

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
  for (std::uint32_t b = 0; b < pressure_.size(); ++b) {
    if (!(softness_[b] > kNoSoftness)) continue;
    double gap = volume_gap_[b] - softness_[b] * pressure_[b];
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      for (int s = 0; s < unknowns_[i].side_count; ++s) {
        const Side& side = unknowns_[i].sides[s];
        if (side.body == b) gap -= side.volume_move.dot(force_[i]);
      }
    }
    const double most = most_pressure_[b];
    const double next = std::clamp(pressure_[b] + gap / softness_[b], -most, most);
    const double change = next - pressure_[b];
    pressure_[b] = next;
    for (const Unknown& u : unknowns_) {
      for (int s = 0; s < u.side_count; ++s) {
        if (u.sides[s].body == b)
          largest = std::max(largest, std::abs(change) * u.sides[s].volume_move.norm());
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
  const std::size_t moving = tissue_.moving_count();
  const Double4* from = as_double4(x_free.data());
  const Double4* swell = as_double4(response_.data());
  Double4* to = as_double4(x.data());
  for (std::uint32_t i = 0; i < moving; ++i) {
    const std::uint32_t body = volume_.body_of_slot(i);
    to[i] = body == EnclosedVolume::kNoBody ? from[i] : from[i] + pressure_[body] * swell[i];
  }
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

double ConstraintSolver::energy() const {
  double twice = 0;
  for (std::size_t b = 0; b < pressure_.size(); ++b) {
    twice += volume_.bodies()[b].compliance * pressure_[b] * pressure_[b];
  }
  return twice / 2;
}

double ConstraintSolver::volume_error(const PaddedVectors& x) {
  if (pressure_.empty()) return 0;
  volume_.measure(x, volumes_);
  double largest = 0;
  for (std::size_t b = 0; b < volumes_.size(); ++b) {
    const auto& body = volume_.bodies()[b];
    if (body.rest_mm3 == 0 || !(softness_[b] > kNoSoftness)) continue;
    const double error = volumes_[b] + body.compliance * pressure_[b] - body.rest_mm3;
    largest = std::max(largest, std::abs(error / body.rest_mm3));
  }
  return largest;
}

}  // namespace organbake::deform
