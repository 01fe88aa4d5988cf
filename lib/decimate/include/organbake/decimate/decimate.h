// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// From an organ's surface to its proxy, and the ways of thinning a surface that stand on their own.

#include <cstddef>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// fitted: a fast pre-pass, Lindstrom–Turk, then vertices and edges fitted to the surface.
// lindstrom_turk (1998, CGAL) and quadric (Garland & Heckbert 1997, OpenMesh): plain collapses
// alone, as other programs make them.
enum class DecimateMethod { fitted, lindstrom_turk, quadric };

struct DecimateOptions {
  DecimateMethod method = DecimateMethod::fitted;
  std::size_t faces = 80;  // at most this many
  // As many more faces than `faces`, up to most_faces, as keep the largest distance both ways
  // within this share of the thickness, vessels by their own; 0 = not asked.
  // What could not be reached shows in the result.
  double max_share = 0;
  std::size_t most_faces = 6000;
  bool flips = true;  // of fitted, up to 500 faces: edges flipped where that lowers the distance

  void check() const;
};

struct DecimateResult {
  TriangleMesh proxy;
  // surface → proxy: RMS at area-uniform samples; the largest of all points, up to 0.05 % more
  double rms_mm = 0, max_mm = 0;
  double reverse_rms_mm = 0, reverse_max_mm = 0;  // proxy → surface
  // Where the larger of both is the largest share of the thickness of the surface; zeros where that
  // has a border.
  double worst_share = 0, worst_mm = 0, worst_thickness_mm = 0;
  double volume_change = 0;  // (proxy − surface) / surface; means little for an open surface
  bool closed_manifold = false;
  std::size_t components = 0, boundary_loops = 0;
  long genus = 0;                           // of all components together; −1: not a manifold
  std::size_t self_intersecting_faces = 0;  // of the proxy
};

// Reduces a surface to a proxy, which keeps its genus, components and manifoldness.
// Throws BadDataError when the surface can't be used or the budget can't be reached.
DecimateResult decimate(const TriangleMesh& surface, const DecimateOptions& options,
                        const RunContext& context = {});

// How many faces a proxy needs for a tool's tip to dent it: edges of about three times the tip's
// radius. Under a smooth skin a dent as wide as an edge is followed to some 5 % of its depth, one
// of half an edge to 22 %; a tip makes dents of twice to three times its radius. At least 80, the
// paper's, and at most 1,500, whose springs are still solved in a fraction of a frame.
// Throws UsageError unless the radius is positive.
std::size_t faces_for_tool(const TriangleMesh& surface, double tool_radius_mm);

// Collapses edges by the memoryless volume- and boundary-preserving cost of Lindstrom & Turk
// (1998) until at most `faces` are left or no collapse keeps the topology. The surface must be
// manifold (manifold_faces()); the result is.
TriangleMesh collapse_edges(const TriangleMesh& surface, std::size_t faces,
                            const RunContext& context = {});

// Collapses edges by error quadrics (Garland & Heckbert 1997) with OpenMesh's decimater: a widely
// used peer; it loses volume at low counts. The surface must be manifold; the result is.
TriangleMesh collapse_by_quadrics(const TriangleMesh& surface, std::size_t faces,
                                  const RunContext& context = {});

// Thins a manifold surface (manifold_faces()) to about `faces`, at a million faces a second: edges
// below a quadric error that rises from pass to pass are collapsed as they come, with no queue.
// Link condition, no turned normals: the result is manifold with the same genus and components.
// Vertices at a border stay. Leaves more faces where nothing more can be collapsed.
TriangleMesh fast_collapse(const TriangleMesh& surface, std::size_t faces,
                           const RunContext& context = {});

}  // namespace organbake
