// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/isosurface/isosurface.h"
#include "organbake/volume/volume.h"

namespace organbake {

// A side of a volume where what is inside reaches its end.
struct CutSide {
  int axis = 0;
  bool high = false;  // the end of the axis, not its beginning
  double area_mm2 = 0;
};

using InsideTest = std::function<bool(double value)>;

// The sides where voxels that are inside are the last ones. Of a mask on a `scan` only where the
// scan ends there, too; a mask whose grid was made round its label ends nowhere else.
std::vector<CutSide> cut_sides(const Volume& volume, const InsideTest& inside,
                               const Volume* scan = nullptr);

// Says that the organ is cut, over which area, and what was made of it. Returns the area.
double tell_cut(const std::vector<CutSide>& sides, SurfaceCap cap, const std::string& whose,
                const RunContext& context);

// The volume with slices behind its cut sides, in which what is inside goes on as a dome and ends:
// over the section's distance to its own edge, half as high as a hemisphere would be. `value` gives
// a voxel its value by how many voxels it lies below the dome (negative: above it).
Volume with_domes(const Volume& volume, const std::vector<CutSide>& sides, const InsideTest& inside,
                  const std::function<double(double depth)>& value);

}  // namespace organbake
