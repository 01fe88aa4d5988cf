// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/warp/view.h"

namespace organbake {

// Lines over the picture, drawn into ImGui's background.
void draw_proxy(const TriangleMesh& proxy, const std::vector<Eigen::Vector3d>& positions,
                const View& view);
// The virtual cameras as pyramids; those in use are bright, as bright as they count.
void draw_cameras(const CameraSet& cameras, const ViewWeights& active, const View& view);
// The VPM: the triangles of cameras, drawn between the cameras themselves.
void draw_manifold(const CameraSet& cameras, const ViewWeights& active, const View& view);

}  // namespace organbake
