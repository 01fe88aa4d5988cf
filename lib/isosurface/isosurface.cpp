// SPDX-License-Identifier: GPL-3.0-or-later
#include "isosurface/isosurface.h"

#include <cmath>
#include <string>

#include "core/error.h"
#include "core/text.h"
#include "isosurface/capped_field.h"
#include "isosurface/contour.h"
#include "isosurface/surface_components.h"

namespace organbake {
namespace {

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

}  // namespace

void IsosurfaceOptions::check() const {
  if (!std::isfinite(iso_hu)) throw UsageError("iso_hu must be a finite number");
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
  check_level(range, options.iso_hu);
  context.throw_if_cancelled();
  // Voxels are whole numbers, so every level in (n − 1, n] parts them alike. The middle one keeps
  // the crossings off the voxel centres, at the price of half a unit: 0.005 mm at 100 HU/mm.
  const double level = std::ceil(options.iso_hu) - 0.5;
  const ContourField field = contour_field(ct, range, level, options.cap);
  TriangleMesh mesh = contour(field.values, field.size, level);
  context.progress(0.6);
  context.throw_if_cancelled();
  if (mesh.empty()) {
    throw BadDataError("no surface at " + number(options.iso_hu) +
                       " HU: the volume is one voxel thin or its border was left open");
  }
  move_to_world(mesh, ct, Eigen::Vector3d::Constant(-field.margin));
  KeptComponents kept = keep_largest(std::move(mesh), options.largest, options.cap);
  context.progress(1);
  return {std::move(kept.mesh), kept.found, kept.kept};
}

}  // namespace organbake
