// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/contour_mask.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "grid/affine_grid.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

// In the plane: small against any CT's pixels, so that bringing the mask onto a CT costs nothing.
constexpr double kFinest_mm = 0.25, kCoarsest_mm = 1;
constexpr double kAcross = 600;  // voxels over the largest region of interest
// Contours further apart than this many usual gaps leave a gap in the organ; one plane may be
// missing.
constexpr double kWidestGap = 2.2;

double usual_gap(const ContourPlanes& planes) {
  std::vector<double> gaps;
  for (auto next = planes.begin(); next != planes.end() && std::next(next) != planes.end();) {
    const double from = next->first;
    gaps.push_back((++next)->first - from);
  }
  if (gaps.empty()) return 0;
  std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2),
                   gaps.end());
  return gaps[gaps.size() / 2];
}

// Of a grid that takes no more memory than its contours' points are a reason for: a few triangles
// over a torso do not ask for a gigabyte.
double most_voxels_for(std::size_t points) {
  constexpr double kAlwaysVoxels = 1.5e7, kVoxelsPerPoint = 3000;
  return kAlwaysVoxels + kVoxelsPerPoint * static_cast<double>(points);
}

struct ContourBox {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(HUGE_VAL), high = -low;
  std::size_t planes = 0, points = 0;
  double gap_mm = HUGE_VAL;  // the smallest that is usual in a region

  void add(const ContourPlanes& region) {
    planes += region.size();
    if (usual_gap(region) > 0) gap_mm = std::min(gap_mm, usual_gap(region));
    for (const auto& [along, contours] : region) {
      for (const ContourRegion::Contour& contour : contours) {
        for (const Polygon2& polygon : contour) {
          points += polygon.size();
          for (const Eigen::Vector2d& p : polygon) {
            low = low.cwiseMin(Eigen::Vector3d(p.x(), p.y(), along));
            high = high.cwiseMax(Eigen::Vector3d(p.x(), p.y(), along));
          }
        }
      }
    }
  }
};

// Into how many slices of the mask a usual gap is parted, so that every plane has its own place:
// contours between the planes of the others keep theirs.
int slices_per_gap(const std::vector<ContourPlanes>& wanted, const ContourBox& box) {
  constexpr int kMost = 8;
  constexpr double kOffPlane = 0.04;  // of a slice
  for (int parts = 1; parts < kMost; ++parts) {
    bool fit = true;
    for (const ContourPlanes& planes : wanted) {
      for (const auto& [along, contours] : planes) {
        const double at = parts * (along - box.low.z()) / box.gap_mm;
        fit &= std::abs(at - std::round(at)) <= kOffPlane;
      }
    }
    if (fit) return parts;
  }
  return kMost;
}

// What the contours of each plane enclose, by the plane's place.
using Regions = std::map<double, ContourRegion>;

// Says what was not simply taken as it is drawn.
Regions regions_of(const ContourPlanes& planes, const std::string& name, Volume& mask) {
  Regions regions;
  std::size_t holes = 0, repeated = 0;
  for (const auto& [along, contours] : planes) {
    const ContourRegion& region = regions.emplace(along, ContourRegion(contours)).first->second;
    holes += region.holes();
    repeated += region.repeated();
  }
  const auto tell = [&](std::size_t count, const char* one, const char* several) {
    if (count == 0) return;
    mask.warnings.push_back(name + ": " + std::to_string(count) + (count == 1 ? one : several));
  };
  tell(holes, " contour lies inside another and is taken as a hole",
       " contours lie inside others and are taken as holes");
  tell(repeated, " contour is there twice and counts once",
       " contours are there twice and count once");
  return regions;
}

// The contours of the nearest plane, unless the region has a gap there.
const ContourRegion* region_at(const Regions& planes, double along, double usual_mm) {
  constexpr double kHalf = 0.51;  // with the positions' rounding
  const auto above = planes.lower_bound(along);
  const auto below = above == planes.begin() ? above : std::prev(above);
  if (above == planes.end()) {
    return along - below->first <= kHalf * usual_mm ? &below->second : nullptr;
  }
  const double up = above->first - along, down = std::abs(along - below->first);
  const bool within = above->first - below->first <= kWidestGap * usual_mm;
  if (!within && std::min(up, down) > kHalf * usual_mm) return nullptr;
  return down < up ? &below->second : &above->second;
}

}  // namespace

Volume grid_of_planes(const std::vector<ContourPlanes>& wanted, const Eigen::Matrix3d& axes,
                      const std::string& name) {
  ContourBox box;
  for (const ContourPlanes& planes : wanted) box.add(planes);
  if (!std::isfinite(box.gap_mm)) box.gap_mm = 1;  // one plane: as thick as that
  // Where one pair of planes lies close together and all others far apart, the gaps are wrong. Two
  // lumps of one region may well lie a torso apart.
  constexpr double kMostSlicesPerPlane = 8, kAlwaysFit = 1000;
  const double gaps = (box.high.z() - box.low.z()) / box.gap_mm;
  if (gaps > kMostSlicesPerPlane * static_cast<double>(box.planes) + kAlwaysFit)
    throw BadDataError(name + ": its planes lie at too uneven gaps, of " + to_text(box.gap_mm, 2) +
                       " mm and more");
  // Over many planes a gap that was rounded adds up: the mean is the true one.
  constexpr double kRoundedGaps = 0.2;
  const double whole = std::round(gaps);
  if (whole > 0 && std::abs(gaps - whole) < kRoundedGaps)
    box.gap_mm = (box.high.z() - box.low.z()) / whole;
  const int parts = slices_per_gap(wanted, box);
  const double across = (box.high - box.low).head<2>().maxCoeff();
  double fine = std::clamp(across / kAcross, kFinest_mm, kCoarsest_mm);
  Volume grid;
  grid.direction = axes;
  Eigen::Vector3d margin, count;
  while (true) {
    grid.spacing_mm = {fine, fine, box.gap_mm / parts};
    // The outermost planes stand for half a gap on either side, like all others.
    margin = {2 * fine, 2 * fine, (box.gap_mm - grid.spacing_mm.z()) / 2};
    count =
        ((box.high - box.low + 2 * margin).cwiseQuotient(grid.spacing_mm).array() + 1.5).floor();
    if (count.prod() <= most_voxels_for(box.points) || fine > across) break;
    constexpr double kCoarser = 1.2;
    fine *= kCoarser;
  }
  checked_grid_size(count, name);
  for (int axis = 0; axis < 3; ++axis) grid.size[axis] = static_cast<int>(count[axis]);
  grid.origin_mm = axes * (box.low - margin);
  return grid;
}

void fill_contours(const ContourPlanes& planes, const LabelName& label, double reach,
                   Volume& mask) {
  const Eigen::Vector3d first = mask.direction.transpose() * mask.origin_mm;
  const Eigen::Vector3d& step = mask.spacing_mm;
  const double usual_mm = std::max(step.z(), usual_gap(planes));
  const Regions regions = regions_of(planes, label.name, mask);
  parallel_for(0, mask.size[2], [&](int k) {
    const ContourRegion* region = region_at(regions, first.z() + k * step.z(), usual_mm);
    if (!region) return;
    for (int j = 0; j < mask.size[1]; ++j) {
      const std::size_t row = (std::size_t(k) * mask.size[1] + j) * mask.size[0];
      for (const auto& [from, to] : region->row(first.y() + j * step.y(), reach)) {
        const int begin = std::max(static_cast<int>(std::ceil((from - first.x()) / step.x())), 0);
        const int end =
            std::min(static_cast<int>(std::ceil((to - first.x()) / step.x())), mask.size[0]);
        for (int i = begin; i < end; ++i) set_value(mask, row + std::size_t(i), label.label);
      }
    }
  });
}

}  // namespace organbake
