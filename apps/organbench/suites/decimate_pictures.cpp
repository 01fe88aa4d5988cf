// SPDX-License-Identifier: GPL-3.0-or-later
#include "error_pictures.h"
#include "organbake/core/text.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/contact_sheet.h"
#include "organbake/player/orbit.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/viewpoints/placement.h"
#include "suites/decimate_parts.h"

namespace organbake {
namespace {

Rgb8Image distance_picture(TriangleMesh surface, const TriangleMesh& proxy, const View& view,
                           double white_mm) {
  const RayScene scene(proxy);
  surface.colors.clear();
  for (const Eigen::Vector3d& v : surface.vertices)
    surface.colors.push_back(heat_color(scene.closest_point(v).distance_mm / white_mm));
  // Where it lies at rest, whatever carries it.
  constexpr std::array<std::uint8_t, 3> kGround = {70, 70, 70};  // apart from no error's black
  const CarriedSurface at_rest(surface, ShellSurface(proxy));
  return at_rest.draw(surface.vertices, view, kGround).color;
}

}  // namespace

void show_distances(Bench& bench, const TriangleMesh& surface,
                    const std::vector<NamedProxy>& proxies) {
  bench.now("pictures of distances");
  constexpr double kWhiteShare = 0.02;  // of the diagonal
  PlacementOptions four;
  four.count = 4;
  const Placement placed = place_cameras(surface, four);
  const View view = orbit_view({placed.cameras, {}, placed.manifold}, {0.4, 0.2}, 320, 320);
  const double white_mm = kWhiteShare * bounds(surface).diagonal();
  std::vector<Rgb8Image> pictures;
  std::string names;
  for (const auto& [name, proxy] : proxies) {
    pictures.push_back(distance_picture(surface, proxy, view, white_mm));
    names += (names.empty() ? "" : ", ") + name;
  }
  bench.show(tile_pictures(pictures, int(pictures.size()), 2),
             "Distance from the surface to a proxy of " +
                 std::to_string(proxies.front().proxy.faces.size()) + " faces: " + names +
                 ". Black is none, white " + to_text(white_mm, 2) + " mm or more.");
}

}  // namespace organbake
