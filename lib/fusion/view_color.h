// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fusion/depth_view.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// What lit the pictures, to be divided out of them.
enum class PictureLight {
  any,     // unknown: colours stay as they are
  camera,  // a lamp at the lens: brightness goes with the cosine over the distance squared
};

// Colours each vertex by all pictures that see it, the straighter and nearer the more; one that
// differs from the others (a highlight) counts less. What none sees takes its neighbours' colour.
// smooth[i] belongs to views[i]. Without any picture the mesh has no colours. Returns the share of
// vertices that a picture sees.
double color_by_views(const std::vector<DepthView>& views, const std::vector<SmoothView>& smooth,
                      PictureLight light, double surface_mm, TriangleMesh& mesh);

}  // namespace organbake
