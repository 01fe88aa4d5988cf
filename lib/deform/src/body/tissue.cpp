// SPDX-License-Identifier: Apache-2.0
// What every kind of tissue has: points numbered by slots, those that others carry, skin that gives
// way beyond them, the pieces that blades have made, and inertia; and which kind stands for bodies.
#include "body/tissue.h"

#include <algorithm>
#include <string>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake::deform {
std::vector<std::uint32_t> number_free(std::size_t points,
                                       const std::vector<std::uint32_t>& anchors) {
  std::vector<std::uint32_t> free_of_point(points, 0);
  for (const std::uint32_t anchor : anchors) free_of_point[anchor] = kAnchored;
  std::uint32_t next = 0;
  for (auto& index : free_of_point) {
    if (index != kAnchored) index = next++;
  }
  return free_of_point;
}

std::size_t count_free(const std::vector<std::uint32_t>& free_of_point) {
  return free_of_point.size() - std::count(free_of_point.begin(), free_of_point.end(), kAnchored);
}

Embedding::Embedding(std::uint32_t first_slot, const std::vector<std::vector<Carrier>>& points)
    : first_slot_(first_slot) {
  if (first_slot == 0) return;  // nothing moves, nor is carried
  for (const std::vector<Carrier>& point : points) {
    double share = 0;
    bool whole = true;
    for (const auto& [slot, weight] : point) {
      if (weight == 0) continue;
      whole = whole && slot < first_slot;
      if (slot >= first_slot) continue;
      share += weight;
      carriers_.push_back({slot, weight});
    }
    first_.push_back(static_cast<std::uint32_t>(carriers_.size()));
    free_shares_.push_back(whole ? 1 : share);  // a sum of weights may be off by rounding
  }
}

void Embedding::carry(PaddedVectors& displacements) const {
  Double4* rows = as_double4(displacements.data());
  for (std::size_t i = 0; i < count(); ++i) {
    Double4 moved{};
    for (const auto& [slot, weight] : carriers_of(i)) moved += weight * rows[slot];
    rows[first_slot_ + i] = moved;
  }
}

void Embedding::carry_positions(const PaddedVectors& rest, PaddedVectors& x) const {
  Double4* at = as_double4(x.data());
  const Double4* from = as_double4(rest.data());
  for (std::size_t i = 0; i < count(); ++i) {
    Double4 moved{};
    for (const auto& [slot, weight] : carriers_of(i)) moved += weight * (at[slot] - from[slot]);
    at[first_slot_ + i] = from[first_slot_ + i] + moved;
  }
}

void Embedding::spread_force(std::uint32_t slot, double force, Eigen::Index lane,
                             PaddedVectors& rows) const {
  for (const auto& [carrier, weight] : carriers_of(slot - first_slot_))
    rows[carrier][lane] += force * weight;
}

void Embedding::spread(PaddedVectors& force) const {
  for (std::size_t i = 0; i < count(); ++i) {
    PaddedVector& own = force[first_slot_ + i];
    for (const auto& [slot, weight] : carriers_of(i)) force[slot] += weight * own;
    own.setZero();
  }
}

SkinGive::SkinGive(std::uint32_t first_slot, std::vector<Place> places,
                   const std::vector<std::vector<Carrier>>& shares)
    : first_slot_(first_slot), places_(std::move(places)), followers_(places_.size()) {
  std::uint32_t slot = first_slot;
  for (const std::vector<Carrier>& point : shares) {
    shares_.insert(shares_.end(), point.begin(), point.end());
    first_.push_back(static_cast<std::uint32_t>(shares_.size()));
    for (const auto& [place, weight] : point) followers_[place].push_back({slot, weight});
    ++slot;
  }
}

std::span<const Carrier> SkinGive::places_of(std::uint32_t slot) const {
  const std::size_t point = slot - first_slot_;
  if (slot < first_slot_ || point + 1 >= first_.size()) return {};
  return std::span(shares_).subspan(first_[point], first_[point + 1] - first_[point]);
}

void SkinGive::relax(PaddedVectors& given) const {
  constexpr double kNothing_mm = 1e-9;
  for (std::size_t p = 0; p < places_.size(); ++p) {
    given[p] *= places_[p].kept;
    if (given[p].squaredNorm() < kNothing_mm * kNothing_mm) given[p].setZero();
  }
}

void SkinGive::move_points(const PaddedVectors& given, PaddedVectors& x) const {
  for (std::size_t p = 0; p < places_.size(); ++p) {
    if (given[p].isZero(0)) continue;
    for (const auto& [slot, weight] : followers_[p]) x[slot] += weight * given[p];
  }
}

void Tissue::take_organs_for_pieces() {
  piece_of_slot_ = organ_of_slot_;
  for (std::size_t slot = 0; slot < size(); ++slot) {
    while (pieces_.size() <= organ_of_slot_[slot])
      pieces_.push_back({false, false, static_cast<std::uint32_t>(pieces_.size())});
    if (slot >= moving_count()) pieces_[organ_of_slot_[slot]].held = true;
  }
}

void Tissue::put_inertia(const PaddedVectors& x, const PaddedVectors& x_coasted,
                         PaddedVectors& force) const {
  const Double4* at = as_double4(x.data());
  const Double4* coasted = as_double4(x_coasted.data());
  Double4* sum = as_double4(force.data());
  for (std::size_t i = 0; i < free_count(); ++i) sum[i] = inertia_[i] * (coasted[i] - at[i]);
  for (std::size_t i = free_count(); i < size(); ++i) sum[i] = Double4{};
}

double Tissue::twice_kinetic_energy(const PaddedVectors& x, const PaddedVectors& x_start) const {
  const Double4* at = as_double4(x.data());
  const Double4* from = as_double4(x_start.data());
  double twice = 0;
  for (std::size_t i = 0; i < free_count(); ++i) {
    const Double4 move = at[i] - from[i];
    twice += inertia_[i] * dot(move, move);
  }
  return twice;
}

std::unique_ptr<const Tissue> make_tissue(const DeformBodies& bodies,
                                          const DeformOptions& options) {
  if (options.solver == TissueSolver::fem)
    return std::make_unique<FemBody>(bodies, options.time_step_s, options.stiffness);
  return std::make_unique<SpringNetwork>(bodies, options.time_step_s, options.stiffness);
}

}  // namespace organbake::deform

namespace organbake {

const char* to_string(TissueSolver solver) {
  return solver == TissueSolver::fem ? "fem" : "springs";
}

std::optional<TissueSolver> tissue_solver(std::string_view name) {
  for (const TissueSolver solver : {TissueSolver::springs, TissueSolver::fem}) {
    if (name == to_string(solver)) return solver;
  }
  return std::nullopt;
}

void DeformOptions::check() const {
  if (!(time_step_s >= 1e-5 && time_step_s <= 1)) {
    throw UsageError("time step is " + to_text(time_step_s) + " s; it must be 0.00001 to 1");
  }
  if (iterations < 1 || iterations > 1000) {
    throw UsageError("iterations is " + std::to_string(iterations) + "; it must be 1 to 1000");
  }
  if (!(friction >= 0 && friction <= 10)) {
    throw UsageError("friction is " + to_text(friction) + "; it must be 0 to 10");
  }
  if (!(stiffness >= kSoftest && stiffness <= kStiffest)) {
    throw UsageError("stiffness is " + to_text(stiffness) + "; it must be 0.05 to 20");
  }
}

DeformOptions DeformOptions::chosen_for(const DeformBodies& bodies) const {
  check();
  DeformOptions chosen = *this;
  if (chosen.solver) return chosen;
  const auto has_body = [](const DeformBody& body) { return body.mechanics.body.has_value(); };
  const bool solid = !bodies.empty() && std::all_of(bodies.begin(), bodies.end(), has_body);
  chosen.solver = solid ? TissueSolver::fem : TissueSolver::springs;
  return chosen;
}

}  // namespace organbake
