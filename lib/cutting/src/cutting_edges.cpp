// SPDX-License-Identifier: Apache-2.0
// Scissors cut where their edges cross. That crossing runs from the pivot to the tips as the
// opening goes to nothing, in proportion to it, which holds for blades that are straight.
#include "organbake/cutting/cutting_edges.h"

namespace organbake {
namespace {

constexpr double kLeastOpening_mm = 0.2;
// Of the way from the pivot to the tips: at the pivot itself there is no opening to cut.
constexpr double kBegin = 0.05;

}  // namespace

std::optional<ClosingScissors::Snip> ClosingScissors::advance(const Eigen::Vector3d& tip_mm,
                                                              const Eigen::Vector3d& pivot_mm,
                                                              const Eigen::Vector3d& opening_mm) {
  const double now_mm = opening_mm.norm();
  const bool closes = now_mm < last_mm_;
  const bool begins = closes && last_mm_ == opened_mm_.norm();
  last_mm_ = now_mm;
  if (!closes) opened_mm_ = opening_mm;
  const double opened_mm = opened_mm_.norm();
  if (!closes || opened_mm < kLeastOpening_mm) return std::nullopt;
  // Blades that turn while they close cut where they are then.
  const Eigen::Vector3d along =
      now_mm > 0 ? Eigen::Vector3d(opening_mm / now_mm) : Eigen::Vector3d(opened_mm_ / opened_mm);
  const auto crossing = [&](double share) -> CuttingEdge {
    const Eigen::Vector3d at = pivot_mm + share * (tip_mm - pivot_mm);
    const Eigen::Vector3d half = 0.5 * share * opened_mm * along;
    return {at - half, at + half};
  };
  Snip snip{std::nullopt, crossing(kBegin + (1 - kBegin) * (1 - now_mm / opened_mm))};
  if (begins) snip.put_down = crossing(kBegin);
  return snip;
}

std::vector<CuttingStep> CuttingEdges::advance(const std::vector<Instrument>& instruments) {
  std::vector<CuttingStep> steps;
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    const Instrument& tool = instruments[i];
    const Scissors* scissors = tool.active ? std::get_if<Scissors>(&tool.kind) : nullptr;
    if (!scissors) {
      scissors_.erase(i);
    } else if (const auto snip =
                   scissors_[i].advance(tool.position_mm, tool.end_mm(), scissors->opening_mm)) {
      steps.push_back({i, snip->edge, scissors->cut_width_mm, snip->put_down});
    }
    const Blade* blade = tool.active ? std::get_if<Blade>(&tool.kind) : nullptr;
    if (blade) steps.push_back({i, {tool.position_mm, tool.end_mm()}, blade->cut_width_mm});
  }
  return steps;
}

}  // namespace organbake
