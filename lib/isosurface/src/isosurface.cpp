// SPDX-License-Identifier: GPL-3.0-or-later
// The surface of a CT at a level. In: voxels, and a level or none. Out: a closed mesh in the world,
// with what was left out and cut. Three steps: a level is proposed where none is given (Otsu 1979),
// contours are placed where sums of voxels say that the edge of the tissue lies (height functions;
// Cummins, Francois, Kothe 2005), and pieces are chosen.
#include "organbake/isosurface/isosurface.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "surface_steps.h"

namespace organbake {
namespace {

// A level for a CT without any: Otsu's threshold (1979) parts the histogram in two classes, and the
// level lies half-way between their peaks, where a voxel is half one tissue and half the other.
// Otsu's own threshold leans to the larger class.

constexpr int kValues = 65536;
// Peaks are looked for through this window, wide enough for a CT's noise to leave one summit.
constexpr int kHalfWindow_hu = 10;

// Whole numbers have a bin each; the span of others is parted as a CT's.
struct Histogram {
  std::vector<double> counts = std::vector<double>(kValues, 0);
  double lowest = std::numeric_limits<std::int16_t>::min(), bin = 1;
  int bins = kValues;

  double value(double at) const { return lowest + bin * at; }
};

Histogram histogram_of(const Volume& ct) {
  constexpr int kBinsOfOthers = 4096;
  Histogram histogram;
  if (ct.is_real()) {
    const ValueRange range = value_range(ct);
    histogram.bins = kBinsOfOthers;
    histogram.bin = (range.max - range.min) / (kBinsOfOthers - 1);
    histogram.lowest = range.min;
  }
  with_values(ct, [&](const auto values) {
    for (const auto value : values) {
      if constexpr (std::is_integral_v<decltype(value + 0)>) {
        ++histogram
              .counts[static_cast<std::size_t>(value - std::numeric_limits<std::int16_t>::min())];
      } else {
        const double at = (value - histogram.lowest) / histogram.bin;
        if (at >= 0) ++histogram.counts[static_cast<std::size_t>(at + 0.5)];
      }
    }
  });
  return histogram;
}

// The first bin of the upper class.
int otsu_split(const std::vector<double>& counts) {
  double all = 0, sum = 0;
  for (int i = 0; i < kValues; ++i) {
    all += counts[i];
    sum += counts[i] * i;
  }
  double below = 0, sum_below = 0, best = -1;
  int split = 0;
  for (int i = 0; i < kValues - 1; ++i) {
    below += counts[i];
    sum_below += counts[i] * i;
    if (below == 0 || below == all) continue;
    const double apart = sum_below / below - (sum - sum_below) / (all - below);
    const double between = below * (all - below) * apart * apart;
    if (between > best) {
      best = between;
      split = i + 1;
    }
  }
  if (best < 0) throw BadDataError("all voxels have one value; there is no level to propose");
  return split;
}

// The value round which [first, end) has most voxels. The window may reach beyond both ends, or a
// peak at an end would be seen from one side only.
double peak(const std::vector<double>& counts, int first, int end) {
  double in_window = 0, most = -1, at = first;
  int plateau = 0;
  for (int i = first - kHalfWindow_hu; i < end + kHalfWindow_hu; ++i) {
    const int enters = i + kHalfWindow_hu, leaves = i - kHalfWindow_hu - 1;
    if (enters >= first && enters < end) in_window += counts[enters];
    if (leaves >= first && leaves < end) in_window -= counts[leaves];
    if (in_window > most) {
      most = in_window;
      at = i;
      plateau = 0;
    } else if (in_window == most && i == at + plateau + 1) {
      ++plateau;  // a single sharp value looks the same from anywhere in the window
    }
  }
  return at + plateau / 2;
}

// With a real minus sign, as people read it.
std::string hu_text(double value) {
  return value < 0 ? "−" + to_text(-value) : to_text(value + 0.0);
}

}  // namespace

std::string ProposedLevel::reason() const {
  return "half-way between the peaks at " + hu_text(low_peak_hu) + " and " + hu_text(high_peak_hu);
}

ProposedLevel propose_level(const Volume& ct) {
  const Histogram histogram = histogram_of(ct);
  const int split = otsu_split(histogram.counts);
  ProposedLevel proposed;
  proposed.low_peak_hu = histogram.value(peak(histogram.counts, 0, split));
  proposed.high_peak_hu = histogram.value(peak(histogram.counts, split, histogram.bins));
  proposed.level_hu = 0.5 * (proposed.low_peak_hu + proposed.high_peak_hu);
  return proposed;
}

// Vertices of a contour moved along their grid edges to where sums of voxels say that the edge of
// the tissue lies (height functions; Cummins, Francois, Kothe 2005): a scanner measures means over
// voxels, not values at points, and a straight line between two means is off.
namespace {

// A transition longer than this many voxels on one side is a grazing edge, where the values change
// slowly and a straight line is right.
constexpr int kLongestSide = 4;
// Of the way from the lower plateau to the upper: a level nearer to either is no edge between them.
constexpr double kLeastRefinedShare = 0.25;
constexpr double kEdgeMargin = 1.0 / 256;  // as contour() keeps it

// The edge of the grid that a vertex lies on: from voxel `from` on along `axis`.
struct GridEdge {
  Eigen::Vector3i from;
  int axis = -1;
};

std::optional<GridEdge> edge_of(const Eigen::Vector3d& vertex, const std::array<int, 3>& size) {
  GridEdge edge;
  for (int a = 0; a < 3; ++a) {
    edge.from[a] = static_cast<int>(std::floor(vertex[a]));
    const bool between = vertex[a] != edge.from[a];
    if (between) edge.axis = a;
    if (edge.from[a] < 0 || edge.from[a] + (between ? 1 : 0) >= size[a]) return std::nullopt;
  }
  return edge.axis < 0 ? std::nullopt : std::optional(edge);
}

// The values of one row of the grid, seen so that they rise at the edge.
template <typename Value>
class Row {
 public:
  Row(std::span<const Value> values, const std::array<int, 3>& size, const GridEdge& edge)
      : length_(size[edge.axis]), first_(edge.from[edge.axis]) {
    Eigen::Vector3i at = edge.from;
    at[edge.axis] = 0;
    stride_ = 1;
    for (int a = 0; a < edge.axis; ++a) stride_ *= size[a];
    values_ = values.data() + (std::ptrdiff_t(at.z()) * size[1] + at.y()) * size[0] + at.x();
    sign_ = value(first_ + 1) > value(first_) ? 1 : -1;
  }

  // Where the edge between voxels first and first + 1 crosses `level`, as an index along the row.
  double straight_crossing(double level) const {
    const double from = value(first_);
    return first_ + (level - from) / (value(first_ + 1) - from);
  }
  std::optional<double> summed_crossing(double level) const {
    const std::optional<int> low = end_of_slope(first_, -1), high = end_of_slope(first_ + 1, 1);
    if (!low || !high) return std::nullopt;
    const double from = value(*low), span = value(*high) - from;
    const double share = (level - from) / span;
    if (!(share >= kLeastRefinedShare && share <= 1 - kLeastRefinedShare)) return std::nullopt;
    double below = 0;  // voxels' worth of the first plateau
    for (int i = *low; i <= *high; ++i) below += 1 - (value(i) - from) / span;
    return *low - 0.5 + below + (share - 0.5);
  }

 private:
  double value(int i) const { return values_[i * stride_]; }

  // The last voxel to which the values go on rising (or falling) from `i` in direction `step`.
  std::optional<int> end_of_slope(int i, int step) const {
    for (int side = 0; side < kLongestSide; ++side) {
      const int next = i + step;
      if (next < 0 || next >= length_) return i;
      if (!(sign_ * step * (value(next) - value(i)) > 0)) return i;
      i = next;
    }
    return std::nullopt;
  }

  int length_, first_;
  int sign_ = 1;
  std::ptrdiff_t stride_;
  const Value* values_;
};

// Moves every vertex along its edge to where `crossing` of the edge's row says.
template <typename Crossing>
void move_along_edges(TriangleMesh& mesh, const Volume& ct, const Crossing& crossing) {
  with_values(ct, [&](const auto values) {
    constexpr std::size_t kVerticesAtOnce = 4096;
    parallel_each(std::size_t{0}, mesh.vertices.size(), kVerticesAtOnce, [&](std::size_t v) {
      Eigen::Vector3d& vertex = mesh.vertices[v];
      const std::optional<GridEdge> edge = edge_of(vertex, ct.size);
      if (!edge) return;
      const double at = crossing(Row(values, ct.size, *edge));
      const int from = edge->from[edge->axis];
      if (!std::isfinite(at)) return;
      vertex[edge->axis] = std::clamp(at, from + kEdgeMargin, from + 1 - kEdgeMargin);
    });
  });
}

// Puts the vertices of a contour, each on an edge of the volume's grid and in its index
// coordinates, where the straight line between the edge's two values crosses `level`, in double
// precision. The contour may have been made at any level that parts the voxels alike. A crossing
// keeps its 1/256 of an edge from the grid points; a vertex beyond the volume's border, or beside a
// NaN, stays.
void place_crossings(TriangleMesh& mesh, const Volume& ct, double level) {
  move_along_edges(mesh, ct, [&](const auto& row) { return row.straight_crossing(level); });
}

}  // namespace

void refine_crossings(TriangleMesh& mesh, const Volume& ct, double level) {
  move_along_edges(mesh, ct, [&](const auto& row) {
    return row.summed_crossing(level).value_or(row.straight_crossing(level));
  });
}

// The surface of a CT at a level: contour by slabs, crossings placed in double precision (and by
// sums of voxels, when asked), pieces chosen. The level of the contour proper is moved between
// whole numbers first, since CT values are whole and would lie on it.
namespace {

constexpr double kLargestSmoothing_mm = 20;  // more would take an organ's shape away

// The level is above what is outside, so among NaNs the lowest value can be inside.
void check_level(const ValueRange& range, double iso_hu) {
  if ((iso_hu > range.min || range.has_nan) && iso_hu <= range.max) return;
  throw BadDataError("the level " + hu_text(iso_hu) + " gives no surface: the volume spans " +
                     hu_text(range.min) + "…" + hu_text(range.max) + "; choose --iso inside it");
}

double told_level(const Volume& ct, const RunContext& context) {
  const ProposedLevel proposed = propose_level(ct);
  context.info("level " + hu_text(proposed.level_hu) + ", " + proposed.reason());
  return proposed.level_hu;
}

void move_all(TriangleMesh& mesh, double by) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex.array() += by;
}

// In the volume's index coordinates. Between whole numbers every level in (n − 1, n] parts the
// voxels alike: the middle one keeps VTK's crossings off the voxel centres, and place_crossings()
// then puts them where the level itself has them.
TriangleMesh contour_of(const Volume& ct, const ValueRange& range, double level,
                        const IsosurfaceOptions& options, const RunContext& context) {
  TriangleMesh mesh = with_values(ct, [&](const auto values) {
    using Value = typename std::remove_cvref_t<decltype(values)>::value_type;
    const double parting = std::is_integral_v<Value> ? std::ceil(level) - 0.5 : level;
    const CappedField<std::remove_const_t<Value>> field(values, ct.size, range, parting,
                                                        options.cap != SurfaceCap::open);
    TriangleMesh crossed = contour_in_slabs(field, context);
    move_all(crossed, -field.margin());
    return crossed;
  });
  options.refine ? refine_crossings(mesh, ct, level) : place_crossings(mesh, ct, level);
  return mesh;
}

// Beyond the cut sides the values fall through the level within two voxels, over the dome.
Volume rounded_off(const Volume& ct, std::vector<CutSide>& sides, const ValueRange& range,
                   double level) {
  const auto inside = with_values(ct, [&](const auto values) {
    return std::count_if(values.begin(), values.end(), [&](auto value) { return value >= level; });
  });
  raise_domes(sides, static_cast<double>(inside) * ct.spacing_mm.prod());
  const double step = 0.5 * std::max(1.0, std::min(range.max - level, level - range.min));
  return with_domes(ct, sides,
                    [&](double depth) { return level + step * std::clamp(2 * depth, -1.0, 1.0); });
}

}  // namespace

void IsosurfaceOptions::check() const {
  if (iso_hu && !std::isfinite(*iso_hu)) throw UsageError("iso_hu must be a finite number");
  if (!(min_size_mm >= 0)) throw UsageError("min_size_mm must not be negative");
  if (!(smooth_mm >= 0 && smooth_mm <= kLargestSmoothing_mm))
    throw UsageError("smooth_mm is " + to_text(smooth_mm) + "; it must be 0…" +
                     to_text(kLargestSmoothing_mm) + " mm");
  if (label < 1 || label > kMostLabel)
    throw UsageError("label is " + std::to_string(label) + "; it must be 1…" +
                     std::to_string(kMostLabel) + " (0 is the background)");
}

Isosurface extract_isosurface(const Volume& ct, const IsosurfaceOptions& options,
                              const RunContext& context) {
  options.check();
  check_volume(ct, "the CT");
  const ValueRange range = value_range(ct);
  const double iso_hu = options.iso_hu ? *options.iso_hu : told_level(ct, context);
  check_level(range, iso_hu);
  context.throw_if_cancelled();
  std::vector<CutSide> sides = cut_sides(ct, [&](double value) { return value >= iso_hu; });
  const bool round = options.cap == SurfaceCap::round && !sides.empty();
  const Volume domed = round ? rounded_off(ct, sides, range, iso_hu) : Volume();
  const Volume& contoured = round ? domed : ct;
  TriangleMesh mesh = contour_of(contoured, range, iso_hu, options, context);
  if (mesh.empty())
    throw BadDataError("no surface at " + hu_text(iso_hu) +
                       ": the volume is one voxel thin or its border was left open");
  move_to_world(mesh, contoured, Eigen::Vector3d::Zero());
  Isosurface surface = finished(std::move(mesh), options, Cavities::filled, "", context);
  surface.cut_area_mm2 = tell_cut(sides, options.cap, "", context);
  surface.level_hu = iso_hu;
  return surface;
}

namespace {

// What the filter of pieces left out is never dropped in silence.
void tell_left_out(const KeptComponents& kept, const std::string& whose,
                   const RunContext& context) {
  if (kept.left_out_share <= 0) return;
  constexpr double kMuch = 0.1;
  const std::string what = whose + std::to_string(kept.kept) + " of " + std::to_string(kept.found) +
                           " pieces of the surface were kept: " + percent(kept.left_out_share, 1) +
                           " of the volume was left out";
  if (kept.left_out_share < kMuch) return context.info(what);
  context.warn(what + "; --largest " + std::to_string(kept.kept + 1) + " keeps one more, 0 all");
}

}  // namespace

void move_to_world(TriangleMesh& mesh, const Volume& grid, const Eigen::Vector3d& first_index) {
  const Eigen::Matrix3d axes = grid.direction * grid.spacing_mm.asDiagonal();
  const Eigen::Vector3d origin = grid.world_from_index(first_index);
  constexpr std::size_t kGrain = 16384;
  parallel_each(std::size_t{0}, mesh.vertices.size(), kGrain,
                [&](std::size_t v) { mesh.vertices[v] = axes * mesh.vertices[v] + origin; });
  if (axes.determinant() > 0) return;
  for (auto& face : mesh.faces) std::swap(face[1], face[2]);
}

Isosurface finished(TriangleMesh mesh, const IsosurfaceOptions& options, Cavities cavities,
                    const std::string& whose, const RunContext& context) {
  if (options.cap == SurfaceCap::open) cavities = Cavities::none;
  KeptComponents kept =
      keep_components(std::move(mesh), {options.largest, options.min_size_mm, cavities});
  if (kept.mesh.empty())
    throw BadDataError(whose + "no piece of the surface is larger than --min-size-mm " +
                       to_text(options.min_size_mm) + " mm");
  context.progress(1);
  tell_left_out(kept, whose, context);
  return {std::move(kept.mesh), kept.found, kept.kept, kept.left_out_share};
}

}  // namespace organbake
