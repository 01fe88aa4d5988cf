// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// An organ as engines hold it: some ten thousand faces under one texture.
struct SkinnedMesh {
  TriangleMesh mesh;                    // with the skin's colours at its vertices, linear
  std::vector<Eigen::Vector2f> texels;  // of each vertex, in pictures' widths; the skin repeats
  Rgb8Image skin;                       // sRGB
};

// Of a surface with colours that rays from its middle meet once: 20 · 4^subdivisions faces with
// their vertices on it, and its colours by longitude and latitude. Throws BadDataError where a ray
// meets nothing.
SkinnedMesh skinned_mesh(const TriangleMesh& surface, int subdivisions, int skin_px);

}  // namespace organbake
