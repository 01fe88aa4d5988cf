// SPDX-License-Identifier: GPL-3.0-or-later
// The surface of a CT at a level: contour by slabs, crossings placed in double precision (and by
// sums of voxels, when asked), pieces chosen, smoothing. The level of the contour proper is moved
// between whole numbers first, since CT values are whole and would lie on it.
#include "organbake/isosurface/isosurface.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <type_traits>

#include "capped_field.h"
#include "cut_sides.h"
#include "organbake/contour/contour.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "proposed_level.h"
#include "refine_crossings.h"
#include "slab_contour.h"
#include "surface_components.h"
#include "taubin.h"

namespace organbake {
namespace {

constexpr int kMostTaubinSteps = 1000;
constexpr double kLargestSmoothing_mm = 20;  // more would take an organ's shape away

// With a real minus sign, as people read it.
std::string number(double value) {
  return value < 0 ? "−" + to_text(-value) : to_text(value + 0.0);
}

// The level is above what is outside, so among NaNs the lowest value can be inside.
void check_level(const ValueRange& range, double iso_hu) {
  if ((iso_hu > range.min || range.has_nan) && iso_hu <= range.max) return;
  throw BadDataError("the level " + number(iso_hu) + " gives no surface: the volume spans " +
                     number(range.min) + "…" + number(range.max) + "; choose --iso inside it");
}

double told_level(const Volume& ct, const RunContext& context) {
  const ProposedLevel proposed = propose_level(ct);
  context.info("level " + number(proposed.level_hu) + ", " + proposed.reason());
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
    TriangleMesh crossed = contour_in_slabs(field, options.method, context);
    move_all(crossed, -field.margin());
    return crossed;
  });
  options.refine ? refine_crossings(mesh, ct, level) : place_crossings(mesh, ct, level);
  return mesh;
}

// Beyond the cut sides the values fall through the level within two voxels, over the dome.
Volume rounded_off(const Volume& ct, const std::vector<CutSide>& sides, const ValueRange& range,
                   double level) {
  const double step = 0.5 * std::max(1.0, std::min(range.max - level, level - range.min));
  return with_domes(
      ct, sides, [&](double value) { return value >= level; },
      [&](double depth) { return level + step * std::clamp(2 * depth, -1.0, 1.0); });
}

}  // namespace

void IsosurfaceOptions::check() const {
  if (iso_hu && !std::isfinite(*iso_hu)) throw UsageError("iso_hu must be a finite number");
  if (!(min_size_mm >= 0)) throw UsageError("min_size_mm must not be negative");
  if (taubin_steps < 0 || taubin_steps > kMostTaubinSteps) {
    throw UsageError("taubin_steps is " + std::to_string(taubin_steps) + "; it must be 0…" +
                     std::to_string(kMostTaubinSteps));
  }
  if (!(smooth_mm >= 0 && smooth_mm <= kLargestSmoothing_mm)) {
    throw UsageError("smooth_mm is " + to_text(smooth_mm) + "; it must be 0…" +
                     to_text(kLargestSmoothing_mm) + " mm");
  }
  if (label < 1 || label > kMostLabel) {
    throw UsageError("label is " + std::to_string(label) + "; it must be 1…" +
                     std::to_string(kMostLabel) + " (0 is the background)");
  }
}

Isosurface extract_isosurface(const Volume& ct, const IsosurfaceOptions& options,
                              const RunContext& context) {
  options.check();
  check_volume(ct, "the CT");
  const ValueRange range = value_range(ct);
  const double iso_hu = options.iso_hu ? *options.iso_hu : told_level(ct, context);
  check_level(range, iso_hu);
  context.throw_if_cancelled();
  const std::vector<CutSide> sides = cut_sides(ct, [&](double value) { return value >= iso_hu; });
  const bool round = options.cap == SurfaceCap::round && !sides.empty();
  const Volume domed = round ? rounded_off(ct, sides, range, iso_hu) : Volume();
  const Volume& contoured = round ? domed : ct;
  TriangleMesh mesh = contour_of(contoured, range, iso_hu, options, context);
  if (mesh.empty()) {
    throw BadDataError("no surface at " + number(iso_hu) +
                       ": the volume is one voxel thin or its border was left open");
  }
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
  parallel_pieces(std::size_t{0}, mesh.vertices.size(), kGrain,
                  [&](std::size_t first, std::size_t last) {
                    for (std::size_t v = first; v < last; ++v)
                      mesh.vertices[v] = axes * mesh.vertices[v] + origin;
                  });
  if (axes.determinant() > 0) return;
  for (auto& face : mesh.faces) std::swap(face[1], face[2]);
}

Isosurface finished(TriangleMesh mesh, const IsosurfaceOptions& options, Cavities cavities,
                    const std::string& whose, const RunContext& context) {
  if (options.cap == SurfaceCap::open) cavities = Cavities::none;
  KeptComponents kept =
      keep_components(std::move(mesh), {options.largest, options.min_size_mm, cavities});
  if (kept.mesh.empty()) {
    throw BadDataError(whose + "no piece of the surface is larger than --min-size-mm " +
                       to_text(options.min_size_mm) + " mm");
  }
  taubin_smooth(kept.mesh, options.taubin_steps, context);
  context.progress(1);
  tell_left_out(kept, whose, context);
  return {std::move(kept.mesh), kept.found, kept.kept, kept.left_out_share};
}

}  // namespace organbake
