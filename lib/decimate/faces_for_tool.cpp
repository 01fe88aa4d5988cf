// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimate/faces_for_tool.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"

namespace organbake {

std::size_t faces_for_tool(const TriangleMesh& surface, double tool_radius_mm) {
  constexpr double kEdgeInRadii = 3;
  constexpr double kFewest = 80, kMost = 1500;
  if (!(tool_radius_mm > 0) || !std::isfinite(tool_radius_mm))
    throw UsageError("tool_radius = " + to_text(tool_radius_mm) + " mm: take a positive length");
  const double edge_mm = kEdgeInRadii * tool_radius_mm;
  const double face_mm2 = std::sqrt(3.0) / 4 * edge_mm * edge_mm;
  const double faces = std::clamp(surface_area(surface) / face_mm2, kFewest, kMost);
  return 2 * static_cast<std::size_t>(faces / 2);  // a closed mesh has an even number
}

}  // namespace organbake
