// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>

#include "measuring/memory_bundle.h"
#include "organbake/decimate/decimate.h"
#include "organbake/image/difference.h"
#include "organbake/phantom/phantom.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/contact_sheet.h"
#include "organbake/player/orbit.h"
#include "promises.h"

namespace organbake {
namespace {

// The phantom's skin where it lies now, in the studio's light.
TriangleMesh lit_where_it_lies(const TriangleMesh& at_rest, const OrganPhantom& phantom,
                               const std::vector<Eigen::Vector3d>& positions) {
  TriangleMesh moved = at_rest;
  moved.vertices = positions;
  const std::vector<Eigen::Vector3d> normals = vertex_normals(moved);
  TriangleMesh lit = at_rest;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const Eigen::Vector3d albedo = phantom.albedo(at_rest.vertices[v]).cast<double>();
    lit.colors[v] =
        albedo.cwiseProduct(studio_lighting().diffuse(normals[v])).cwiseMin(1.0).cast<float>();
  }
  return lit;
}

struct PokedErrors {
  double baked_db = 1e9, relit_db = 1e9;  // the least over the views
};

PokedErrors errors_of_poke(const TriangleMesh& surface, const OrganPhantom& phantom, Player& player,
                           int size_px, double share) {
  const Bundle& bundle = player.bundle();
  hold_poke(player, bundle.cameras.manifold.directions.front(), share,
            bundle.mechanics.instrument_radius_mm);
  const auto positions = CarriedSurface(surface, bundle.shell()).carry(player.proxy_positions());
  const CarriedSurface truth(lit_where_it_lies(surface, phantom, positions), bundle.shell());
  PokedErrors errors;
  for (const double angle_rad : {-0.5, 0.0, 0.5}) {
    const View view = orbit_view(bundle.cameras, {angle_rad}, size_px, size_px);
    DrawOptions options;
    options.background = {0, 0, 0};
    const TruthFrame expected = truth.draw(positions, view, options.background);
    const auto error_db = [&](bool relight) {
      options.light = relight ? DrawnLight::world : DrawnLight::baked;
      Frame frame;
      player.draw(view, options, frame);
      std::vector<std::uint8_t> shown = expected.covered;
      for (std::size_t i = 0; i < shown.size(); ++i)
        shown[i] |= frame.cover[i] != Cover::background;
      return compare_images(frame.color, expected.color, shown).psnr_db;
    };
    errors.baked_db = std::min(errors.baked_db, error_db(false));
    errors.relit_db = std::min(errors.relit_db, error_db(true));
  }
  player.reset();
  return errors;
}

TEST(CaptureLight, OfAPokedPhantomIsThatOfItsTruth) {
  const OrganPhantom phantom({});
  TriangleMesh surface = phantom.surface(6);
  const TriangleMesh proxy = decimate(surface, {}).proxy;
  // The light of the very mesh, so that only its turning is measured.
  surface = lit_where_it_lies(surface, phantom, surface.vertices);
  PlacementOptions placement;
  placement.count = 8;
  placement.map_size = 1024;
  const auto player_over = [&](double skin_edge_mm) {
    Bundle bundle = memory_bundle(surface, proxy, placement, {}, skin_edge_mm);
    bundle.lighting = studio_lighting();
    bundle.lighting->gloss.clear();  // the truth is matt
    return Player(std::move(bundle));
  };
  Player player = player_over(6), in_prisms = player_over(0);
  const int size_px = 720;
  for (const double share : {0.1, 0.3}) {
    const PokedErrors errors = errors_of_poke(surface, phantom, player, size_px, share);
    const std::string scene_name =
        "poked by " + std::to_string(static_cast<int>(100 * share)) + " %: ";
    expect({scene_name + "lit anew, against the phantom in the same light", "dB", errors.relit_db,
            0, Figure::Goal::at_least});
    expect({scene_name + "lit anew above the light that was baked", "dB",
            errors.relit_db - errors.baked_db, 3, Figure::Goal::at_least});
    const PokedErrors prisms = errors_of_poke(surface, phantom, in_prisms, size_px, share);
    expect({scene_name + "lit anew over the smooth skin above prisms, each by its own truth", "dB",
            errors.relit_db - prisms.relit_db, 3, Figure::Goal::at_least});
  }
}

}  // namespace
}  // namespace organbake
