// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/volume/volume.h"

namespace organbake {

// What becomes of a surface where the volume, or its mask, ends and the organ goes on: it is cut
// flat, half a voxel beyond the last voxel centres; goes on in a dome of at most a twentieth of its
// volume; or is left open where it leaves the volume.
enum class SurfaceCap { flat, round, open };

struct IsosurfaceOptions {
  // The level, when no mask is given; the organ is above it. Nothing = proposed_level().
  std::optional<double> iso_hu = -300;
  // Keep the K pieces of largest area; 0 = all. A cavity is no piece of its own: a label's stay
  // with the piece that they lie in, a CT's (lungs in a body) are filled, unless all is kept.
  std::size_t largest = 1;
  double min_size_mm = 0;  // pieces whose box is nowhere longer than this go, too
  // Moves the vertices to where the sums of the voxels across the edge put it, instead of where two
  // voxels alone do: see refine_crossings(). For a CT, not for a mask.
  bool refine = false;
  SurfaceCap cap = SurfaceCap::flat;
  // Standard deviation of the Gaussian on a mask; more is taken where the mask's stairs are higher
  // (a mask drawn at 3 mm has stairs of 3 mm, whatever grid it was brought onto), since less lets
  // them through; 0 = no blur at all.
  double smooth_mm = 1.0;
  // Of a mask: the level that encloses the volume of its voxels; otherwise one half, as textbooks
  // have it, which takes a voxel's corners off. An open surface has no volume to keep.
  bool keep_volume = true;
  int label = 1;  // the mask's label

  void check() const;
};

struct Isosurface {
  TriangleMesh mesh;  // world mm, outward
  std::size_t components_found = 0;
  std::size_t components_kept = 0;
  double left_out_share = 0;  // of all components' volume (area, of an open surface), 0…1
  double cut_area_mm2 =
      0;                // where the volume or the mask cuts what is inside, before it was closed
  double level_hu = 0;  // of a CT's surface: the one asked for, or proposed
};

// Marching cubes' surface (vtkFlyingEdges3D) of a CT at iso_hu, each vertex where the straight line
// between two voxels crosses the level. What is NaN is outside. The faces look outward, from tissue
// to air, also on left-handed grids. The surface is closed unless the cap is open. What is left out
// and what is cut is told; a tenth of the volume and more as a warning. Throws BadDataError when
// the level lies outside the volume's values ("the volume spans −1024…1650") or nothing is left.
Isosurface extract_isosurface(const Volume& ct, const IsosurfaceOptions& options,
                              const RunContext& context = {});

// A smooth closed surface around one label of a mask, on the mask's own grid: the level of the
// blurred label that encloses the volume of its voxels, to 0.1 %; said when it misses that by more
// than 1 %. `scan`, whose voxels don't count, tells where it cuts the organ off; without it that is
// the mask's own border. A label that ends flat is cut there, too, since organs taper. Throws
// BadDataError when the label is absent (the labels present are named), or so fine for its
// smoothing that 10 % of its volume would be missed.
Isosurface extract_label_surface(const Volume& mask, const IsosurfaceOptions& options,
                                 const RunContext& context = {}, const Volume* scan = nullptr);

}  // namespace organbake
