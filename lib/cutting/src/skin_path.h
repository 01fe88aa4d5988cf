// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "organbake/cutting/cut_sheet.h"

namespace organbake {

// Where sheets' lines of one stroke, between two of its places, meet a face: from the first place
// to the second, without what lies on the straight way between them to `within_mm`.
struct PathPoint {
  Eigen::Vector2d in_face;
  SheetPlace place;
};
std::vector<PathPoint> path_within(const std::array<Eigen::Vector3d, 3>& face,
                                   const PathPoint& from, const PathPoint& to,
                                   const CutSheet& sheet, double within_mm);

}  // namespace organbake
