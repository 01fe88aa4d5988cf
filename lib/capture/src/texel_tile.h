// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/capture/camera_rays.h"
#include "organbake/capture/capture.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/geometry/shell_binder.h"

namespace organbake {

inline constexpr int kTileSide = 16;  // texels: coherent rays, and enough of them to share out

// What one capture works on.
struct CaptureScene {
  const TracedSurface& surface;
  const ShellBinder& shell;
  const SurfaceColor& color;
  int rays_per_side;
};

struct TileCounts {
  std::size_t in_prism = 0, by_fallback = 0, unbound = 0, back_faces = 0;
  double largest_height_mm = 0;
};

// An empty map of the camera's size: all background.
CameraMaps background_maps(const Intrinsics& intrinsics);

// Fills the texels of one tile: depth at their centres, colour, face and height; confidence holds
// the incidence alone until fade_at_edges, where it is 0 they have a depth alone.
TileCounts capture_tile(const CaptureScene& scene, const PosedCamera& camera, int left, int top,
                        CameraMaps& maps);

// Lowers the confidence of texels near a depth edge, where cameras disagree. Texels that have none
// become background: nobody draws them. Returns how many did.
std::size_t fade_at_edges(const Intrinsics& intrinsics, CameraMaps& maps);

// Leads the colours some texels on beyond the outline. Nobody draws them: a program in which a map
// is painted or made smaller then mixes no black into the rim.
void lead_colors_beyond_outline(CameraMaps& maps);

}  // namespace organbake
