// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"
#include "organbake/formats/textured_mesh.h"

namespace organbake {

struct TexturedSurfaceOptions {
  std::size_t faces = 10000;  // at most; 0 = all of the base layer's
  int texture_side = 2048;    // texels, 64…8192; 0 = as many as the maps are fine
  // Colours freed from the light that they were baked in, for viewers that light anew; needs a
  // bundle that knows its light.
  bool albedo = false;

  void check() const;  // throws UsageError
};

// A bundle's surface at rest for programs that draw with a GPU: reduced to a number of faces, laid
// flat in charts, in one atlas of the maps' colours and of their normals, whose edges are padded so
// that filters find the surface's own colours. Where no map shows the surface the base layer does.
// All maps must have been read. The same for any number of threads. Throws UsageError when albedo
// is asked of a bundle that does not know its light.
TexturedMesh textured_surface(const Bundle& bundle, const TexturedSurfaceOptions& options,
                              const RunContext& context = {});

}  // namespace organbake
