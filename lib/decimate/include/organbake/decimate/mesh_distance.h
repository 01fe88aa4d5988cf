// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

struct MeshDistance {
  double mean_mm = 0;
  double rms_mm = 0;
  double max_mm = 0;  // over the samples: a lower bound of the one-sided Hausdorff distance
};

// One-sided distance: from `samples` points spread evenly by area over `from` (stratified, one
// random stream a sample) to their closest points on `to`. The same for any number of threads.
// Throws BadDataError when `from` is unusable or has no area.
MeshDistance mesh_distance(const TriangleMesh& from, const RayScene& to, std::size_t samples,
                           std::uint64_t seed, const RunContext& context = {});

// The one-sided Hausdorff distance in mm from all points of `from`, not samples, to `to` (whose
// search tree is `scene`), by branch and bound over the faces of `from`: never below it and at most
// 0.05 % above, as far as pieces of 1/1024 of a face's edge tell, or of 1/4 to 1/32
// where a face covers several in its plane. The same for any number of threads. Throws BadDataError
// when `from` is unusable.
double largest_distance(const TriangleMesh& from, const TriangleMesh& to, const RayScene& scene,
                        const RunContext& context = {});

// Faces in groups: the group of each, and how many groups there are.
struct FaceGroups {
  const std::vector<std::uint32_t>& of_face;
  std::size_t count;
};
// The same from the points of each group's faces; 0 for a group without any.
std::vector<double> largest_distances(const TriangleMesh& from, const FaceGroups& groups,
                                      const TriangleMesh& to, const RayScene& scene,
                                      const RunContext& context = {});

}  // namespace organbake
