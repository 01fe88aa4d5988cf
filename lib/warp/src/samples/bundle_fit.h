// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/bundle/bundle.h"

namespace organbake {

// Throws BadDataError unless cameras, viewing manifold, base layer and proxy go together; the maps
// are counted only.
void check_fit(const Bundle& bundle);
// Throws BadDataError unless a camera's maps have its size and name the proxy's faces.
void check_maps_fit(const CameraMaps& maps, std::size_t camera, const Intrinsics& lens,
                    std::size_t faces);
// Throws BadDataError unless there is a finite position for every vertex of the proxy.
void check_positions(const std::vector<Eigen::Vector3d>& positions, const TriangleMesh& proxy);

}  // namespace organbake
