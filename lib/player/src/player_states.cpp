// SPDX-License-Identifier: Apache-2.0
// States that another solver computes. A picture needs the proxy's positions alone, so they are
// taken as they are, and cost a copy; the player's own solver follows when it is next asked to
// step.
#include <utility>

#include "inside_of_skin.h"
#include "organbake/player/player.h"

namespace organbake {

struct Player::Placed {
  explicit Placed(const Bundle& now) : reader(now) {}

  StateReader reader;
  OrganState last, next;  // what was set, and room for what comes
  bool since_step = false;
  StateOf of = StateOf::vertices;
};

template <class Number>
void Player::place(std::span<const Number> xyz_mm, StateOf of, std::size_t which) {
  organ_at(which);  // throws where there is none
  Organ& organ = organs_[which];
  if (!organ.placed) organ.placed = std::make_shared<Placed>(organ.now());
  Placed& placed = *organ.placed;
  placed.reader.read(xyz_mm, of, placed.next);
  std::swap(placed.last, placed.next);
  placed.of = of;
  placed.since_step = true;
  organ.positions = placed.last.vertices_mm;
}

void Player::set_vertices(std::span<const float> xyz_mm, std::size_t organ) {
  place(xyz_mm, StateOf::vertices, organ);
}
void Player::set_vertices(std::span<const double> xyz_mm, std::size_t organ) {
  place(xyz_mm, StateOf::vertices, organ);
}
void Player::set_nodes(std::span<const float> xyz_mm, std::size_t organ) {
  place(xyz_mm, StateOf::nodes, organ);
}
void Player::set_nodes(std::span<const double> xyz_mm, std::size_t organ) {
  place(xyz_mm, StateOf::nodes, organ);
}

void Player::save_placed(const Organ& organ, std::optional<OrganState>& state, StateOf& of) {
  if (organ.placed && organ.placed->since_step) state = organ.placed->last, of = organ.placed->of;
}

void Player::restore_placed(Organ& organ, const std::optional<OrganState>& state, StateOf of) {
  if (!state) return;
  organ.placed = std::make_shared<Placed>(organ.now());
  organ.placed->last = *state, organ.placed->of = of;
  organ.placed->since_step = true;
  organ.positions = state->vertices_mm;
}

bool Player::go_on_from_placed() {
  bool any = false;
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    const Organ& organ = organs_[o];
    if (!organ.placed || !std::exchange(organ.placed->since_step, false)) continue;
    any = true;
    const OrganState& state = organ.placed->last;
    if (options_.solver == TissueSolver::springs) {
      deformer_.place(o, state.vertices_mm);
    } else if (organ.placed->of == StateOf::nodes) {
      deformer_.place(o, state.nodes_mm);
    } else {
      const Bundle& now = organ.now();
      deformer_.place(o, nodes_under(*now.mechanics.body, now.proxy.vertices, state.vertices_mm));
    }
  }
  return any;
}

std::vector<Eigen::Vector3d> Player::contact_force_n(const std::vector<Instrument>& instruments,
                                                     std::size_t organ) {
  const std::size_t count = organ_at(organ).positions.size();
  std::size_t first = 0;
  for (std::size_t o = 0; o < organ; ++o) first += organs_[o].positions.size();
  go_on_from_placed();
  std::vector<std::vector<Eigen::Vector3d>> lay;
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    lay.push_back(options_.solver == TissueSolver::fem ? deformer_.node_positions(o)
                                                       : organs_[o].positions);
  }
  const auto lie_still = [&] {
    for (std::size_t o = 0; o < organs_.size(); ++o) deformer_.place(o, lay[o]);
  };
  lie_still();
  deformer_.step(instruments);
  const std::vector<Eigen::Vector3d> all = deformer_.contact_force_n();
  lie_still();
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

}  // namespace organbake
