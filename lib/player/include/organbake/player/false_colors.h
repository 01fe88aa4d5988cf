// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/warp/view.h"

namespace organbake {

// By vertex, how far (mm) a surface has moved.
std::vector<double> displacement_mm(const std::vector<Eigen::Vector3d>& rest_mm,
                                    const std::vector<Eigen::Vector3d>& posed_mm);

// By vertex, how much a surface is stretched or squeezed in its plane: of the two principal
// stretches of each face the one farther from 1, less 1 (negative where squeezed), as the mean of
// the vertex's faces by their area at rest. Lists of vertices are the same faces'.
std::vector<double> surface_strain(const std::vector<Face>& faces,
                                   const std::vector<Eigen::Vector3d>& rest_mm,
                                   const std::vector<Eigen::Vector3d>& posed_mm);

// sRGB of a share 0…1 (beyond: of the nearer end), dark to bright for every eye: viridis (Smith,
// van der Walt & Firing 2015), between nine of its colours.
std::array<std::uint8_t, 3> false_color(double share);

// A surface as it lies now, with a number at each vertex.
struct MeasuredSurface {
  TriangleMesh posed;
  std::vector<double> values;
};

// The frame with the skin's colours replaced by those of the numbers, from `least` to `most`; its
// own light and dark remains, so that shapes do. Tools and background are as they were.
Rgb8Image false_color_picture(const Frame& frame, const View& view,
                              const std::vector<MeasuredSurface>& surfaces, double least,
                              double most);

}  // namespace organbake
