// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "core/run_context.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

enum class DecimateMethod { lindstrom_turk, cluster };

struct DecimateOptions {
  DecimateMethod method = DecimateMethod::lindstrom_turk;
  std::size_t faces = 80;  // at most this many

  void check() const;
};

struct DecimateSummary {
  TriangleMesh proxy;
  double rms_mm = 0, max_mm = 0;                  // surface → proxy, at area-uniform samples
  double reverse_rms_mm = 0, reverse_max_mm = 0;  // proxy → surface
  double volume_change = 0;  // (proxy − surface) / surface; means little for an open surface
  bool closed_manifold = false;
};

// Reduces a surface to a proxy. lindstrom_turk keeps the topology (Lindstrom & Turk 1998, CGAL);
// cluster is the paper's "naive sub-sampling" (vertex clustering on a grid), which need not stay
// manifold. Throws BadDataError when the surface can't be used or the budget can't be reached.
DecimateSummary decimate(const TriangleMesh& surface, const DecimateOptions& options,
                         const RunContext& context = {});

}  // namespace organbake
