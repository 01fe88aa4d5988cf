// SPDX-License-Identifier: Apache-2.0
// What blades sweep, in the body at rest. Scissors cut where their edges cross: that crossing runs
// from the pivot to the tips as the opening goes to nothing, in proportion to it, which holds for
// blades that are straight. A blade's edge is carried back to the body at rest, line by line:
// sheets are kept there, where nothing moves, and the strips of many steps join without gaps.
#include "organbake/cutting/blade_sweeps.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

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

namespace {

constexpr double kLeastWay_mm = 0.4;  // shorter ways wait for more
constexpr double kLongestPiece_mm =
    2.5;  // of a way: what lies between two places must not be missed
constexpr int kMostPieces = 256;
constexpr double kSampleEvery_mm = 2;  // tissue along the edge
constexpr int kMostSamples = 64;
// On either side of what a blade felt of tissue it may have cut more.
constexpr double kBeside_mm = 3;

Eigen::Vector3d along(const CuttingEdge& blade, int point) {
  const double share = double(point) / (BladeLine::kPoints - 1);
  return blade.tip_mm + share * (blade.top_mm - blade.tip_mm);
}

double way_mm(const CuttingEdge& from, const CuttingEdge& to) {
  return std::max((to.tip_mm - from.tip_mm).norm(), (to.top_mm - from.top_mm).norm());
}

CuttingEdge between(const CuttingEdge& from, const CuttingEdge& to, double share) {
  return {from.tip_mm + share * (to.tip_mm - from.tip_mm),
          from.top_mm + share * (to.top_mm - from.top_mm)};
}

// Places farther out continue the blade's edge.
void extend(BladeLine& line, const SkinInside& inside, double reach_mm) {
  constexpr int kTop = BladeLine::kRows - 1;
  auto& p = line.points_mm;
  line.tip_is_out = !inside(p[1]);
  line.top_is_out = !inside(p[kTop - 1]);
  p[0] = p[1] + (line.tip_is_out ? reach_mm : 0) * (p[1] - p[2]).normalized();
  p[kTop] =
      p[kTop - 1] + (line.top_is_out ? reach_mm : 0) * (p[kTop - 1] - p[kTop - 2]).normalized();
}

// A line that lies `reach_mm` on from the second of two.
BladeLine farther_on(const BladeLine& before, const BladeLine& line, double reach_mm,
                     bool all_out) {
  double way = 0;
  for (int k = 0; k < BladeLine::kRows; ++k)
    way = std::max(way, (line.points_mm[k] - before.points_mm[k]).norm());
  BladeLine farther = line;
  farther.all_out = all_out;
  for (int k = 0; way > 0 && k < BladeLine::kRows; ++k)
    farther.points_mm[k] += reach_mm / way * (line.points_mm[k] - before.points_mm[k]);
  return farther;
}

}  // namespace

std::optional<BladePath::Carried> BladePath::carried(const CuttingEdge& blade,
                                                     const PosedBody& posed,
                                                     const SkinInside& inside, double reach_mm) {
  const double length_mm = (blade.top_mm - blade.tip_mm).norm();
  const int last = static_cast<int>(
      std::clamp(std::ceil(length_mm / kSampleEvery_mm), 8.0, double(kMostSamples)));
  const std::vector<std::uint32_t> near =
      posed.near(blade.tip_mm.cwiseMin(blade.top_mm), blade.tip_mm.cwiseMax(blade.top_mm));
  std::vector<std::pair<double, std::uint32_t>> in;  // share of the edge, copy
  for (int i = 0; !near.empty() && i <= last; ++i) {
    const double share = double(i) / last;
    const auto found = posed.find(blade.tip_mm + share * (blade.top_mm - blade.tip_mm), near);
    if (found && inside(found->at_rest_mm)) in.emplace_back(share, found->copy);
  }
  if (in.empty()) return std::nullopt;
  Carried carried;
  for (int k = 0; k < BladeLine::kPoints; ++k) {
    const double share = double(k) / (BladeLine::kPoints - 1);
    const auto nearest = std::min_element(in.begin(), in.end(), [&](const auto& a, const auto& b) {
      return std::abs(a.first - share) < std::abs(b.first - share);
    });
    carried.by[k] = posed.cut().held_corner(nearest->second);
  }
  carried.line = carried_by(carried.by, blade, posed, inside, reach_mm);
  carried.line.skin_mm = blade.tip_mm + in.back().first * (blade.top_mm - blade.tip_mm);
  return carried;
}

BladeLine BladePath::carried_by(const Carriers& by, const CuttingEdge& blade,
                                const PosedBody& posed, const SkinInside& inside, double reach_mm) {
  BladeLine line;
  for (int k = 0; k < BladeLine::kPoints; ++k)
    line.points_mm[k + 1] = posed.at_rest(posed.cut().copy_at(by[k]), along(blade, k));
  extend(line, inside, reach_mm);
  return line;
}

void BladePath::pass(const CuttingEdge& to, const StrokeOptions& stroke, const PosedBody& posed,
                     const SkinInside& inside, double reach_mm, CutSheet& sheet) {
  const auto here = carried(to, posed, inside, reach_mm);
  if (here) {
    if (!cutting_) {  // as the tissue that it comes to carries the place it comes from
      sheet.begin_stroke(stroke.width_mm, stroke.fine_mm);
      const BladeLine before = carried_by(here->by, *last_, posed, inside, reach_mm);
      // A blade that was put down within the tissue comes from nowhere else.
      if (entered_) {
        sheet.add(farther_on(here->line, before, reach_mm, true));
        sheet.add(farther_on(here->line, before, kBeside_mm, false));
      }
      sheet.add(before);
    }
    entered_ = false;
    sheet.add(here->line);
    last_by_ = here->by;
  } else if (cutting_) {  // and the place that it leaves to, as that which it comes from
    const BladeLine after = carried_by(last_by_, to, posed, inside, reach_mm);
    const BladeLine before = sheet.strokes().back().back();
    sheet.add(after);
    sheet.add(farther_on(before, after, kBeside_mm, false));
    sheet.add(farther_on(before, after, reach_mm, true));
  }
  cutting_ = here.has_value();
  entered_ = entered_ || !cutting_;
  last_ = to;
}

void BladePath::advance(const CuttingEdge& to, const StrokeOptions& stroke, const PosedBody& posed,
                        const SkinInside& inside, double reach_mm, CutSheet& sheet) {
  if (!last_) {
    last_ = to;
    entered_ = !carried(to, posed, inside, reach_mm);
    return;
  }
  const CuttingEdge from = *last_;
  const double way = way_mm(from, to);
  if (!(way >= kLeastWay_mm)) return;
  const int pieces =
      static_cast<int>(std::clamp(std::ceil(way / kLongestPiece_mm), 1.0, double(kMostPieces)));
  for (int piece = 1; piece <= pieces; ++piece)
    pass(between(from, to, double(piece) / pieces), stroke, posed, inside, reach_mm, sheet);
}

namespace {

// Elements stand out of the skin by no more than their size.
constexpr double kReachPerEdge = 1.5;
// A hole that is narrower would not show, and take very small faces.
constexpr double kLeastHoleRadius_mm = 0.3;
constexpr double kHoleDepth_mm = 6;
constexpr double kAboveSkin_mm = 3;

}  // namespace

void BladeSweeps::advance(std::span<const CuttingStep> steps, const CutOrgan& organ,
                          const std::vector<Eigen::Vector3d>& nodes_mm) {
  for (auto& [instrument, path] : paths_) {
    if (std::none_of(steps.begin(), steps.end(),
                     [&, i = instrument](const CuttingStep& s) { return s.instrument == i; }))
      path.lift();
  }
  if (steps.empty()) return;
  const PosedBody posed(organ.body(), nodes_mm);
  const double reach_mm = kReachPerEdge * organ.body().mean_edge_mm();
  for (const CuttingStep& now : steps) {
    BladePath& path = paths_[now.instrument];
    const auto advance = [&](const CuttingEdge& to) {
      path.advance(to, {now.width_mm}, posed, organ.inside(), reach_mm, sheet_);
    };
    if (now.put_down) path.lift(), advance(*now.put_down);
    advance(now.edge);
  }
}

// A blade that passes from one side of the needle to the other, and takes away as much across.
void BladeSweeps::pierce(const Eigen::Vector3d& at_mm, const Eigen::Vector3d& up_needle,
                         double radius_mm, const CutOrgan& organ,
                         const std::vector<Eigen::Vector3d>& nodes_mm) {
  const double radius = std::max(radius_mm, kLeastHoleRadius_mm);
  const Eigen::Vector3d aside = radius * up_needle.unitOrthogonal();
  const PosedBody posed(organ.body(), nodes_mm);
  const double reach_mm = kReachPerEdge * organ.body().mean_edge_mm();
  BladePath path;
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector3d at = at_mm + side * aside;
    path.advance({at - kHoleDepth_mm * up_needle, at + kAboveSkin_mm * up_needle},
                 {2 * radius, radius}, posed, organ.inside(), reach_mm, sheet_);
  }
}

}  // namespace organbake
