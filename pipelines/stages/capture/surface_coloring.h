// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "organbake/capture/surface_color.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

// Photographs when there are any, else the surface's own vertex colours, else the exemplar's
// tissue, else the material, with the light that they show when it is known: `lighting`, but a
// material's is its own. What was passed over is told in the report, and so is the choice.
struct SurfaceColoring {
  std::unique_ptr<SurfaceColor> color;
  std::optional<Lighting> lighting;
};
SurfaceColoring choose_coloring(const TracedSurface& surface, std::vector<Photo> photos,
                                const std::optional<ExemplarPhoto>& exemplar,
                                const Material& material, const std::optional<Lighting>& lighting,
                                StageReport& report);

}  // namespace organbake
