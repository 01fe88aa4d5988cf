// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct FittedOptions {
  std::size_t faces = 80;
  bool flips = true;     // of edges, up to kMostFacesToFlip
  bool largest = false;  // minimise the largest distance, not the RMS; the volume is free then
  bool thorough = true;  // largest: dense samples and many steps; a search can do with less
};

inline constexpr std::size_t kMostFacesToFlip = 500;
inline constexpr std::size_t kMostFacesToFit = 20'000;  // beyond, Lindstrom–Turk's answer stands

// A proxy of at most `faces` faces, fitted to a manifold surface (manifold_faces()): a fast
// pre-pass, Lindstrom–Turk on the rest, vertices moved to lower the two-sided distance with the
// volume kept, edges flipped where that lowers it further. Manifold, same genus and components;
// no face turns, and no step is kept that makes the proxy meet itself. More faces than asked for
// where the topology allows no fewer.
[[nodiscard]] TriangleMesh fitted_proxy(const TriangleMesh& surface, const FittedOptions& options,
                                        const RunContext& context = {});

}  // namespace organbake
