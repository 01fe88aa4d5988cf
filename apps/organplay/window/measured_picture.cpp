// SPDX-License-Identifier: Apache-2.0
#include "window/measured_picture.h"

#include "organbake/player/false_colors.h"

namespace organbake {

Rgb8Image measured_picture(const WindowState& state, const Player& player, const View& view,
                           const Frame& frame) {
  const bool strain = state.colors == FalseColors::strain;
  std::vector<MeasuredSurface> surfaces;
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    const ShellSurface shell = player.bundle_now(o).shell();
    MeasuredSurface surface{shell.posed(player.proxy_positions(o)), {}};
    const TriangleMesh& rest = shell.at_rest();
    surface.values = strain ? surface_strain(rest.faces, rest.vertices, surface.posed.vertices)
                            : displacement_mm(rest.vertices, surface.posed.vertices);
    surfaces.push_back(std::move(surface));
  }
  const double most = strain ? state.most_strain : state.most_displacement_mm;
  return false_color_picture(frame, view, surfaces, strain ? -most : 0, most);
}

}  // namespace organbake
