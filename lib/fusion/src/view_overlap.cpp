// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/fusion/fuse_views.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/median.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr int kAcross = 40;  // points of a view, in each direction
// A surface behind or in front of another by more is another one.
constexpr double kSameSurface = 0.5;
// Poses and noise move a surface by less.
constexpr double kAgreeing = 0.06;

}  // namespace

std::vector<ViewOverlap> measure_overlap(const std::vector<SmoothView>& views) {
  std::vector<ViewOverlap> overlaps;
  for (const SmoothView& view : views) {
    const int step = std::max(1, std::max(view.depth_mm.width, view.depth_mm.height) / kAcross);
    double points = 0, shared = 0, agreeing = 0;
    std::vector<double> logs;
    for (int y = step / 2; y < view.depth_mm.height; y += step)
      for (int x = step / 2; x < view.depth_mm.width; x += step) {
        if (!(view.weight.at(x, y) > 0)) continue;
        ++points;
        const Eigen::Vector3d point = view.point_world_mm(x, y);
        const Eigen::Vector3d normal = view.normal_world(x, y);
        bool seen_too = false, agrees = false;
        for (const SmoothView& other : views) {
          if (&other == &view) continue;
          const SeenSurface seen = seen_at(other, point);
          if (!(seen.weight > 0) || !is_same_side(other, seen, normal)) continue;
          const double ratio = std::log(seen.point_z_mm / seen.depth_mm);
          if (std::abs(ratio) > kSameSurface) continue;
          seen_too = true;
          agrees = agrees || std::abs(ratio) < kAgreeing;
          logs.push_back(ratio);
        }
        shared += seen_too;
        agreeing += agrees;
      }
    const double usual = logs.empty() ? 0 : median(logs);
    for (double& ratio : logs) ratio = std::abs(ratio - usual);
    overlaps.push_back({points > 0 ? shared / points : 0, std::exp(usual),
                        shared > 0 ? agreeing / shared : 1, median(std::move(logs))});
  }
  return overlaps;
}

bool sees_nothing_in_common(const ViewOverlap& overlap) {
  constexpr double kLeastShare = 0.02;
  return overlap.share < kLeastShare;
}

bool is_of_another_scale(const ViewOverlap& overlap) {
  // What hides behind something is farther away, too; but then not everything is, nor by as much.
  constexpr double kFewAgree = 0.15, kMostScale = 1.15, kMostSpread = 0.35;
  const double apart = std::abs(std::log(overlap.scale));
  return overlap.agreeing < kFewAgree && apart > std::log(kMostScale) &&
         overlap.spread < kMostSpread * apart;
}

void check_overlap(const std::vector<ViewOverlap>& overlaps, const std::vector<DepthView>& views) {
  if (views.size() < 2) return;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ViewOverlap& overlap = overlaps[i];
    if (sees_nothing_in_common(overlap))
      throw BadDataError(views[i].name,
                         "sees nothing that another depth map sees: is its pose right, and its "
                         "depth in millimetres?");
    if (is_of_another_scale(overlap))
      throw BadDataError(views[i].name, "lies " + to_text(overlap.scale, 2) +
                                            " times as far away as the other depth maps have the "
                                            "same surface: it is of another scale (--scale each "
                                            "finds one for each map)");
  }
}

}  // namespace organbake
