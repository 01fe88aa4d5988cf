// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// From a surface, its proxy, cameras and colours to what a bundle holds: maps, base layer, and the
// smooth skin.

#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/capture/surface_color.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct CaptureOptions {
  // n×n rays are averaged for the colour of one texel, up to 16; 0: one where the colour hardly
  // changes within a texel, or else 2.
  int rays_per_texel_side = 0;
  double base_step_mm = 1.5;  // spacing of the base layer's nodes, 0.01…1000

  // Throws UsageError.
  void check() const;
};

struct CaptureResult {
  std::vector<CameraMaps> maps;  // one per camera
  BaseLayer base;
  std::size_t bound_in_prism = 0;
  std::size_t bound_by_fallback = 0;  // unclamped, see ShellBinder
  std::size_t unbound_texels = 0;     // no face of the proxy carries them: stored as background
  std::size_t back_face_texels = 0;   // saw the surface from inside: stored as background
  std::size_t unsure_texels = 0;      // of no confidence: stored as background, too
  double largest_height_mm = 0;
};

// Bakes the maps of each camera and the base layer of the proxy.
//   depth       planar z of the first hit at the texel's centre, to 17 bits (8·10⁻⁶ of itself: the
//               noise below would not compress)
//   color       mean over n×n rays, without those that meet another surface than the centre's
//   face, height_mm  the binding of the stored depth's point in the proxy's shell, the height to
//               2·10⁻⁶ of the depth; the player solves b1, b2 again from depth and height
//   confidence  smooth in the angle between surface and view (0 from 80°, 1 up to 60°) times
//               smooth in the distance to a depth edge (1 from three texels on)
// Texels without confidence are background, and those that no face of the proxy carries. The same
// bytes for any number of threads. Throws UsageError, or BadDataError for a broken or empty mesh,
// no cameras, or bad intrinsics.
CaptureResult capture(const TracedSurface& surface, const TriangleMesh& proxy,
                      const std::vector<PosedCamera>& cameras, const SurfaceColor& color,
                      const CaptureOptions& options, const RunContext& context = {});

// Maps that hold nothing, or little beside what saw the surface from behind, would play as an empty
// picture: throws BadDataError that says what to do about the surface of this name.
void check_filled(const CaptureResult& captured, const std::string& surface);

// A smooth skin over the proxy along the surface, with edges of about edge_mm. The same for any
// number of threads. Throws UsageError unless edge_mm is positive, BadDataError for broken meshes.
SmoothSkin bake_smooth_skin(const TracedSurface& surface, const TriangleMesh& proxy, double edge_mm,
                            const RunContext& context = {});

}  // namespace organbake
