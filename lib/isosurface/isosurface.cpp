// SPDX-License-Identifier: GPL-3.0-or-later
#include "isosurface/isosurface.h"

#include <cmath>
#include <string>

#include "core/error.h"
#include "core/text.h"
#include "isosurface/capped_field.h"
#include "isosurface/contour.h"
#include "isosurface/proposed_level.h"
#include "isosurface/slab_contour.h"
#include "isosurface/smoothing.h"
#include "isosurface/surface_components.h"

namespace organbake {
namespace {

constexpr int kMostTaubinSteps = 1000;
constexpr double kLargestSmoothing_mm = 20;  // more would take an organ's shape away

// With a real minus sign, as people read it.
std::string number(double value) {
  return value < 0 ? "−" + to_text(-value) : to_text(value + 0.0);
}

void check_level(const ValueRange& range, double iso_hu) {
  if (iso_hu > range.min && iso_hu <= range.max) return;
  throw BadDataError("the level " + number(iso_hu) + " HU gives no surface: the volume spans " +
                     number(range.min) + "…" + number(range.max) + " HU; choose --iso inside it");
}

double told_level(const Volume& ct, const RunContext& context) {
  const ProposedLevel proposed = propose_level(ct);
  context.info("level " + number(proposed.level_hu) + " HU, " + proposed.reason());
  return proposed.level_hu;
}

void move_all(TriangleMesh& mesh, double by) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex.array() += by;
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
  if (label < 1 || label > 32767) {
    throw UsageError("label is " + std::to_string(label) +
                     "; it must be 1…32767 (0 is the background)");
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
  // Voxels are whole numbers, so every level in (n − 1, n] parts them alike. The middle one keeps
  // the crossings off the voxel centres, at the price of half a unit: 0.005 mm at 100 HU/mm.
  const double level = std::ceil(iso_hu) - 0.5;
  const CappedField field(ct, range, level, options.cap);
  TriangleMesh mesh = contour_in_slabs(field, level, options.method, context);
  if (mesh.empty()) {
    throw BadDataError("no surface at " + number(iso_hu) +
                       " HU: the volume is one voxel thin or its border was left open");
  }
  if (options.refine) {
    move_all(mesh, -field.margin());
    refine_crossings(mesh, ct, level);
    move_to_world(mesh, ct, Eigen::Vector3d::Zero());
  } else {
    move_to_world(mesh, ct, Eigen::Vector3d::Constant(-field.margin()));
  }
  Isosurface surface = finished(std::move(mesh), options, context);
  surface.level_hu = iso_hu;
  return surface;
}

Isosurface finished(TriangleMesh mesh, const IsosurfaceOptions& options,
                    const RunContext& context) {
  KeptComponents kept =
      keep_components(std::move(mesh), {options.largest, options.min_size_mm, options.cap});
  if (kept.mesh.empty()) {
    throw BadDataError("no piece of the surface is larger than --min-size " +
                       to_text(options.min_size_mm) + " mm");
  }
  taubin_smooth(kept.mesh, options.taubin_steps, context);
  context.progress(1);
  return {std::move(kept.mesh), kept.found, kept.kept};
}

}  // namespace organbake
