// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>

#include "core/error.h"
#include "player/player.h"

namespace organbake {

void Player::cut(const std::vector<InstrumentTip>& tips) {
  std::vector<CutOrgan::BladeNow> blades;
  for (std::size_t i = 0; i < tips.size(); ++i) {
    const InstrumentTip& tip = tips[i];
    if (tip.active && tip.mode == InstrumentMode::cut)
      blades.push_back({i, {tip.position_mm, tip.position_mm + tip.axis_mm}});
  }
  if (!blades.empty()) {
    Deformer::check(tips);
    if (options_.solver != TissueSolver::fem)
      throw UsageError(
          "an instrument cuts, which springs cannot follow: play with the solver fem, from bundles "
          "baked with --set mechanics.fem=true");
  }
  std::vector<std::uint8_t> changed(organs_.size(), 0);
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    Organ& organ = organs_[o];
    if (!organ.cutting && blades.empty()) continue;
    if (!organ.cutting) organ.cutting = std::make_unique<CutOrgan>(organ.bundle);
    const std::vector<Eigen::Vector3d> nodes =
        blades.empty() ? std::vector<Eigen::Vector3d>() : deformer_.node_positions(o);
    changed[o] = organ.cutting->sweep(blades, nodes);
  }
  if (std::find(changed.begin(), changed.end(), 1) != changed.end()) take_cuts(changed);
}

void Player::take_cuts(const std::vector<std::uint8_t>& changed) {
  std::vector<std::vector<std::uint32_t>> sources;
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    Organ& organ = organs_[o];
    if (changed[o]) {
      organ.cut_warper.emplace(organ.warper.cut(organ.cutting->now(), organ.cutting->face_parts()));
      organ.positions = organ.cutting->now().proxy.vertices;
      sources.push_back(organ.cutting->node_sources());
      continue;
    }
    sources.emplace_back(organ.now().mechanics.body->nodes_mm.size());
    std::iota(sources.back().begin(), sources.back().end(), 0u);
  }
  deformer_ = Deformer(deform_bodies(), options_, deformer_, sources);
  take_positions();
}

std::size_t Player::piece_count(std::size_t organ) const {
  const Organ& asked = organs_[organ];
  return asked.cut_warper ? asked.cutting->body().cut().fragment_count() : 1;
}

}  // namespace organbake
