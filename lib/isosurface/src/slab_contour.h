// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "capped_field.h"
#include "organbake/contour/contour.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The contour of a whole field in its index coordinates, slab by slab: what VTK needs beside its
// input (half the volume again, and three times the mesh) is only needed for one slab at a time.
// The slabs share a slice; their vertices on it are made one. Same result for any number of
// threads. slices_per_slab 0 = as many as make about 4 million voxels. Throws CancelledError
// between slabs.
template <typename Value>
TriangleMesh contour_in_slabs(const CappedField<Value>& field, IsosurfaceMethod method,
                              const RunContext& context, int slices_per_slab = 0);

}  // namespace organbake
