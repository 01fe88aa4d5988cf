// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "dicom/contour_region.h"
#include "organbake/volume/volume.h"

namespace organbake {

// The contours of one region by the place of their plane on the normal (mm), in coordinates of the
// planes' own axes.
using ContourPlanes = std::map<double, std::vector<ContourRegion::Contour>>;

// A grid for the regions that are wanted, of the planes of the one with most, in voxels that are
// small against any CT's pixels; axes: columns u, v, normal. Where planes lie between those of the
// others it has more slices. Throws BadDataError for planes at too uneven gaps.
Volume grid_of_planes(const std::vector<ContourPlanes>& wanted, const Eigen::Matrix3d& axes,
                      const std::string& name);

// Gives the voxels inside the contours of the nearest plane their label; `reach`: how far (mm)
// outside a contour a voxel's centre still belongs to it. What was not simply taken as it is drawn
// goes into the mask's warnings.
void fill_contours(const ContourPlanes& planes, const LabelName& label, double reach, Volume& mask);

}  // namespace organbake
