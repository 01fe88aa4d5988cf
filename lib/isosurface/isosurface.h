// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>

#include "core/run_context.h"
#include "geometry/triangle_mesh.h"
#include "isosurface/contour.h"
#include "volume/volume.h"

namespace organbake {

struct IsosurfaceOptions {
  // The level, when no mask is given; the organ is above it. Nothing = proposed_level().
  std::optional<double> iso_hu = -300;
  IsosurfaceMethod method = IsosurfaceMethod::flying_edges;
  // Keep the K pieces of largest area; 0 = all. Cavities of a closed surface don't count as pieces
  // and go, unless all is kept.
  std::size_t largest = 1;
  double min_size_mm = 0;  // pieces whose box is nowhere longer than this go, too
  // Moves the vertices to where the sums of the voxels across the edge put it, instead of where two
  // voxels alone do: see refine_crossings(). For a CT, not for a mask.
  bool refine = false;
  int taubin_steps = 0;  // of smoothing on the finished mesh, volume kept to 0.1 %
  bool cap = true;       // close the surface where it leaves the volume
  // Standard deviation of the Gaussian on a mask; more is taken where the mask's stairs are higher
  // (a mask drawn at 3 mm has stairs of 3 mm, whatever grid it was brought onto), since less lets
  // them through; 0 = no blur at all.
  double smooth_mm = 1.0;
  int label = 1;  // the mask's label

  void check() const;
};

struct Isosurface {
  TriangleMesh mesh;  // world mm, outward
  std::size_t components_found = 0;
  std::size_t components_kept = 0;
  double level_hu = 0;  // of a CT's surface: the one asked for, or proposed
};

// Marching cubes' surface (vtkFlyingEdges3D) of a CT at iso_hu, to half a unit: every level between
// two whole numbers parts the voxels alike, so the middle is taken. The faces look outward, from
// tissue to air, also on left-handed grids. With `cap` the result is closed: where the organ leaves
// the volume it is cut flat, half a voxel beyond the last voxel centres. Throws BadDataError when
// the level lies outside the volume's values ("the volume spans −1024…1650 HU") or nothing is left.
Isosurface extract_isosurface(const Volume& ct, const IsosurfaceOptions& options,
                              const RunContext& context = {});
// A smooth closed surface around one label of a mask: the level of the blurred label that encloses
// the volume of its voxels, to 0.1 %; said when it misses that by more than 1 %. Throws
// BadDataError when the label is absent (the labels present are named), or so fine for its
// smoothing that 10 % of its volume would be missed.
Isosurface extract_label_surface(const Volume& mask, const IsosurfaceOptions& options,
                                 const RunContext& context = {});

}  // namespace organbake
