// SPDX-License-Identifier: GPL-3.0-or-later
// Turns parallel planes, as scanners and segmentation programs write them, into slices of a grid.
// In: the corner of every plane (PS3.3, C.7.6.2: ImagePositionPatient and ImageOrientationPatient
// alone tell where pixels lie), and what a file says of their distance. Out: how thick each plane
// is, and for masks a grid that takes each plane's pixels as they are.
#include "grid/grids.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "organbake/core/error.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr double kDriftSteps = 1000;  // per pixel
// A plane this far from another's place, in gaps, lies somewhere else.
constexpr double kOffPlane = 0.05;
// Slices of a CT are not thicker: what lies further apart are two lumps, and no gap.
constexpr double kThickest_mm = 10;
constexpr double kAssumed_mm = 1;
// What a file tells of a gap counts up to here.
constexpr double kMostTold_mm = 100;

std::vector<double> steps_of(const std::vector<double>& places) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < places.size(); ++i) steps.push_back(places[i] - places[i - 1]);
  return steps;
}

// Whether every step is a whole number of gaps, whose last digit may be rounded.
bool are_multiples(const std::vector<double>& steps, double gap) {
  constexpr double kRoundedGap = 0.005, kMost = 0.25;
  return gap > 0 && gap <= kMostTold_mm &&
         std::all_of(steps.begin(), steps.end(), [&](double step) {
           const double gaps = step / gap, whole = std::round(gaps);
           return whole >= 1 &&
                  std::abs(gaps - whole) <= std::min(kMost, kOffPlane + kRoundedGap * whole);
         });
}

// The places of the scan's planes along a normal that one of its axes has, from below `low` to
// above `high`; none where no axis has it. What was cut off a regular scan goes on.
std::vector<double> planes_of_scan(const Volume& scan, const Eigen::Vector3d& normal, double low,
                                   double high) {
  constexpr double kParallel = 2e-3, kMostPlanes = 1e5;
  for (int axis = 0; axis < 3; ++axis) {
    if (scan.direction.col(axis).cross(normal).norm() > kParallel) continue;
    std::vector<double> places;
    if (axis == 2 && !scan.slices.corners_mm.empty()) {
      for (const Eigen::Vector3d& corner : scan.slices.corners_mm)
        places.push_back(corner.dot(normal));
    } else {
      const double step = scan.spacing_mm[axis], first = scan.origin_mm.dot(normal);
      const double begin = std::floor((low - first) / step) - 1;
      const double end = std::ceil((high - first) / step) + 1;
      if (end - begin > kMostPlanes) return {};
      for (double k = begin; k <= end; ++k) places.push_back(first + k * step);
    }
    std::sort(places.begin(), places.end());
    return places;
  }
  return {};
}

// The scan's plane at a place; none where it lies between two.
std::optional<std::size_t> plane_at(const std::vector<double>& planes, double place, double slack) {
  if (planes.size() < 2) return std::nullopt;
  const auto above = std::lower_bound(planes.begin(), planes.end(), place) - planes.begin();
  const auto last = static_cast<std::ptrdiff_t>(planes.size()) - 1;
  std::ptrdiff_t nearest = std::min(above, last);
  if (nearest > 0 && place - planes[nearest - 1] < std::abs(planes[nearest] - place)) --nearest;
  const std::ptrdiff_t other = nearest < last ? nearest + 1 : nearest - 1;
  const double gap = std::abs(planes[other] - planes[nearest]);
  if (std::abs(planes[nearest] - place) > slack * gap) return std::nullopt;
  return static_cast<std::size_t>(nearest);
}

std::vector<std::size_t> planes_at(const std::vector<double>& planes,
                                   const std::vector<double>& places, bool by_hand) {
  constexpr double kDrawnOffPlane = 0.25;  // contours' positions may have one digit
  std::vector<std::size_t> found;
  for (const double place : places) {
    const auto plane = plane_at(planes, place, by_hand ? kDrawnOffPlane : kOffPlane);
    if (!plane) return {};
    found.push_back(*plane);
  }
  return found;
}

// Contours on every third slice of a fine scan, and frames that tell the gap that they have, of a
// thicker reconstruction, mean their own gap.
bool is_own_gap(double shown, double gap_of_scan, std::size_t steps, const GapClues& clues) {
  constexpr double kOneLeftOut = 2.2, kAlike = 0.05;
  if (shown == 0) return false;
  if (clues.by_hand)
    return steps >= 3 && shown > kOneLeftOut * gap_of_scan && shown <= kThickest_mm;
  const double told = clues.told_mm > 0 ? clues.told_mm : clues.thickness_mm;
  return shown > (1 + kAlike) * gap_of_scan && std::abs(told / shown - 1) < kAlike;
}

// Half-way to the planes that the scan has beside each; those at its ends are as thick as their
// inner half.
std::vector<Slab> slabs_on_scan(const std::vector<double>& planes,
                                const std::vector<std::size_t>& at, bool by_hand) {
  const auto half = [&](std::size_t plane, int towards) {
    const auto last = static_cast<std::ptrdiff_t>(planes.size()) - 1;
    const auto here = static_cast<std::ptrdiff_t>(plane);
    const std::ptrdiff_t next =
        here + towards < 0 || here + towards > last ? here - towards : here + towards;
    return std::abs(planes[next] - planes[here]) / 2;
  };
  std::vector<Slab> slabs;
  for (const std::size_t plane : at)
    slabs.push_back({planes[plane] - half(plane, -1), planes[plane] + half(plane, 1)});
  for (std::size_t i = 1; by_hand && i < at.size(); ++i) {
    if (at[i] - at[i - 1] != 2) continue;
    slabs[i - 1].high_mm = slabs[i].low_mm = (planes[at[i - 1]] + planes[at[i]]) / 2;
  }
  return slabs;
}

std::vector<Slab> slabs_at_gap(const std::vector<double>& places, double gap, bool by_hand) {
  // One plane of contours may be missing.
  const double most = (by_hand ? 2.2 : 1.2) * gap;
  std::vector<Slab> slabs;
  for (const double place : places) slabs.push_back({place - gap / 2, place + gap / 2});
  for (std::size_t i = 1; i < places.size(); ++i) {
    if (places[i] - places[i - 1] > most) continue;
    slabs[i - 1].high_mm = slabs[i].low_mm = (places[i - 1] + places[i]) / 2;
  }
  return slabs;
}

[[noreturn]] void throw_uneven(const std::vector<double>& steps, const std::string& name) {
  const auto [least, most] = std::minmax_element(steps.begin(), steps.end());
  throw BadDataError(name + ": has frames at uneven gaps, of " + to_text(*least, 2) + "…" +
                     to_text(*most, 2) +
                     " mm; give the CT that it was made on, or save it on that CT's grid");
}

// Where no scan has the planes: what most of them show, held against what their file tells.
double gap_without_scan(const std::vector<double>& places, double gap_of_scan,
                        const GapClues& clues, const std::string& name,
                        std::vector<std::string>& warnings) {
  constexpr double kAlike = 0.05, kDense = 0.5, kMostTimes = 5;
  const std::vector<double> steps = steps_of(places);
  const double shown = shown_gap(places);
  const bool told_fits = are_multiples(steps, clues.told_mm);
  if (shown > 0 && (!told_fits || std::abs(shown / clues.told_mm - 1) <= kAlike)) return shown;
  if (shown > 0) {
    // Every second plane left out is more likely than a wrong gap, two of three are less; and two
    // planes that are many told gaps apart are two lumps.
    const double slices = (places.back() - places.front()) / clues.told_mm + 1;
    const bool told = static_cast<double>(places.size()) > kDense * slices ||
                      (steps.size() < 3 && shown > kMostTimes * clues.told_mm);
    const double gap = told ? clues.told_mm : shown;
    warnings.push_back("its planes lie " + to_text(shown, 2) + " mm apart, though it tells " +
                       to_text(clues.told_mm, 2) + " mm from plane to plane; each was taken for " +
                       to_text(gap, 2) + " mm thick. The CT that it was made on would tell");
    return gap;
  }
  const bool apart = !steps.empty() && *std::min_element(steps.begin(), steps.end()) > kThickest_mm;
  for (const double gap : {clues.told_mm, clues.thickness_mm})
    if (are_multiples(apart ? std::vector<double>() : steps, gap)) return gap;
  if (clues.by_hand && !steps.empty() && !apart) {
    const double usual = median(steps);
    return usual <= kThickest_mm ? usual : *std::min_element(steps.begin(), steps.end());
  }
  if (gap_of_scan > 0) return gap_of_scan;
  if (!steps.empty() && !apart) throw_uneven(steps, name);
  warnings.push_back("how thick its planes are is told nowhere; " + to_text(kAssumed_mm) +
                     " mm was assumed. The CT that it was made on would tell");
  return kAssumed_mm;
}

// What lies far apart need not fit: it is a lump of its own.
void check_gaps(const std::vector<double>& places, double gap, const std::string& name) {
  constexpr double kFar = 3.5;
  const std::vector<double> steps = steps_of(places);
  for (const double step : steps)
    if (step < kFar * gap && !are_multiples({step}, gap)) throw_uneven(steps, name);
}

// A lattice for places (pixels) that are rounded to it: it begins where their mean error is 0.
Eigen::Vector2d lattice_for(const std::vector<Eigen::Vector2d>& drifts) {
  constexpr int kRounds = 8;
  Eigen::Vector2d begin = Eigen::Vector2d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Vector2d error = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& drift : drifts)
      error += drift - begin - (drift - begin).array().round().matrix();
    begin += error / static_cast<double>(drifts.size());
  }
  return begin;
}

}  // namespace

PlaneStack::PlaneStack(const Eigen::Matrix3d& unit_axes, const Eigen::Vector2d& size_mm,
                       std::vector<Eigen::Vector3d> corners)
    : axes(unit_axes), pixel_mm(size_mm), corners_mm(std::move(corners)) {
  for (const Eigen::Vector3d& corner : corners_mm) {
    const Eigen::Vector3d offset = corner - corners_mm.front();
    along_mm.push_back(offset.dot(axes.col(2)));
    const Eigen::Vector2d drift(offset.dot(axes.col(0)) / pixel_mm.x(),
                                offset.dot(axes.col(1)) / pixel_mm.y());
    // Positions are decimal text: whole pixels must stay whole, or borders mix with air.
    drift_px.push_back((drift * kDriftSteps).array().round().matrix() / kDriftSteps);
  }
}

double shown_gap(const std::vector<double>& places) {
  constexpr double kAlike = 1.05;
  const std::vector<double> steps = steps_of(places);
  if (steps.empty()) return 0;
  const double least = *std::min_element(steps.begin(), steps.end());
  double sum = 0;
  std::size_t alike = 0;
  for (const double step : steps) {
    if (step > kAlike * least) continue;
    sum += step;
    ++alike;
  }
  const double most = steps.size() >= 3 ? 2 * kThickest_mm : kThickest_mm;
  const bool a_run = (2 * alike >= steps.size() || are_multiples(steps, least)) && least <= most;
  return a_run ? sum / static_cast<double>(alike) : 0;
}

std::vector<Slab> slabs_of(const std::vector<double>& places, const Eigen::Vector3d& normal,
                           const GapClues& clues, const std::string& name,
                           std::vector<std::string>& warnings) {
  std::vector<double> planes;
  if (clues.scan) planes = planes_of_scan(*clues.scan, normal, places.front(), places.back());
  const double gap_of_scan = median(steps_of(planes));
  const std::vector<std::size_t> at = planes_at(planes, places, clues.by_hand);
  const double shown = shown_gap(places);
  if (!at.empty() && !is_own_gap(shown, gap_of_scan, places.size() - 1, clues))
    return slabs_on_scan(planes, at, clues.by_hand);
  const double gap = gap_without_scan(places, gap_of_scan, clues, name, warnings);
  if (!clues.by_hand) check_gaps(places, gap, name);
  return slabs_at_gap(places, gap, clues.by_hand);
}

std::pair<int, int> EvenSlices::of(const Slab& slab) const {
  const auto border = [&](double at) {
    return static_cast<int>(std::lround((at - first_mm) / spacing_mm + 0.5));
  };
  const int begin = std::clamp(border(slab.low_mm), 0, count - 1);
  return {begin, std::clamp(border(slab.high_mm), begin + 1, count)};
}

EvenSlices slices_for(const std::vector<Slab>& slabs, const std::string& name) {
  double low = HUGE_VAL, high = -HUGE_VAL, thin = HUGE_VAL;
  std::set<double> borders;
  for (const Slab& slab : slabs) {
    borders.insert({slab.low_mm, slab.high_mm});
    low = std::min(low, slab.low_mm);
    high = std::max(high, slab.high_mm);
    thin = std::min(thin, slab.thickness_mm());
  }
  const double span = high - low;
  // Where one pair of planes lies close together and all others far apart, the gaps are wrong. Two
  // lumps of one region may well lie a torso apart.
  constexpr double kMostSlicesPerPlane = 8, kAlwaysFit = 4000;
  if (!(span / thin <= kMostSlicesPerPlane * static_cast<double>(slabs.size()) + kAlwaysFit))
    throw BadDataError(name + ": its planes lie at too uneven gaps, of " + to_text(thin, 2) +
                       " mm and more");
  const auto off_border = [&](int count) {
    double off = 0;
    for (const double border : borders) {
      const double at = (border - low) / span * count;
      off = std::max(off, std::abs(at - std::round(at)) / count * span);
    }
    return off;
  };
  // Positions are decimal text, of two digits at least.
  constexpr double kRounded_mm = 0.011, kRoundedShare = 2.5e-3;
  constexpr int kFinest = 16, kMostBorders = 20'000'000;  // looked at in all
  const double slack = std::max(kRounded_mm, kRoundedShare * thin);
  const int least = std::max(1, static_cast<int>(std::lround(span / thin)));
  int best = least;
  double best_off = HUGE_VAL;
  const int most =
      std::min(kFinest * least, least + kMostBorders / static_cast<int>(borders.size()));
  for (int count = least; best_off > slack && count <= most; ++count) {
    const double off = off_border(count);
    if (off >= best_off) continue;
    best = count;
    best_off = off;
  }
  const double spacing = span / best;
  return {low + spacing / 2, spacing, best};
}

PlacedPlanes placed(const PlaneStack& stack, const std::vector<Slab>& slabs, int columns, int rows,
                    const std::string& name) {
  PlacedPlanes result;
  const EvenSlices slices = slices_for(slabs, name);
  const Eigen::Vector2d lattice = lattice_for(stack.drift_px);
  Eigen::Vector2d low = Eigen::Vector2d::Constant(HUGE_VAL), high = -low;
  std::vector<Eigen::Vector2d> corners;
  for (const Eigen::Vector2d& drift : stack.drift_px) {
    corners.push_back((drift - lattice).array().round());
    low = low.cwiseMin(corners.back());
    high = high.cwiseMax(corners.back());
  }
  const Eigen::Vector3d size(columns + high.x() - low.x(), rows + high.y() - low.y(), slices.count);
  // However sparse a file is, its grid is none of far more voxels than it has pixels.
  constexpr double kMostGrowth = 1000, kAlwaysFits = 5e7;
  const double pixels = static_cast<double>(columns) * rows * static_cast<double>(slabs.size());
  set_calculated_size(result.grid, size, name);
  if (size.prod() > std::max(kMostGrowth * pixels, kAlwaysFits))
    throw BadDataError(name + ": its frames lie too far apart for one grid");
  std::size_t lowest = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2i at = (corners[i] - low).cast<int>();
    const auto [slice, end] = slices.of(slabs[i]);
    result.places.push_back({at.x(), at.y(), slice, end});
    if (slice < result.places[lowest].slice) lowest = i;
  }
  // From the lowest plane, so that no digit is lost where its own corner is the grid's.
  constexpr double kNothing_mm = 1e-6;
  const Eigen::Vector2d aside_mm =
      (lattice + low - stack.drift_px[lowest]).cwiseProduct(stack.pixel_mm);
  double up_mm = slices.first_mm - stack.corners_mm[lowest].dot(stack.axes.col(2));
  if (std::abs(up_mm) < kNothing_mm) up_mm = 0;
  set_grid(
      result.grid,
      stack.axes *
          Eigen::Vector3d(stack.pixel_mm.x(), stack.pixel_mm.y(), slices.spacing_mm).asDiagonal(),
      stack.corners_mm[lowest] + stack.axes * Eigen::Vector3d(aside_mm.x(), aside_mm.y(), up_mm),
      name);
  return result;
}

}  // namespace organbake
