// SPDX-License-Identifier: GPL-3.0-or-later

#include "measuring/scenes.h"
#include "organbake/decimate/decimate.h"
#include "organbake/image/difference.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/player/player.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/frame_albedo.h"
#include "organbake/warp/view.h"
#include "promises.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kAside_rad = 20 * std::numbers::pi / 180;

// Five places 20° round a point ahead of the camera, in that camera's axes.
PosedCamera aside(const Intrinsics& lens, double range_mm, int place) {
  const double turn = 2 * std::numbers::pi * place / 5;
  const Vector3d ahead(0, 0, range_mm);
  const Vector3d axis(std::cos(turn), std::sin(turn), 0);
  PosedCamera view;
  view.name = "aside";
  view.intrinsics = lens;
  const Vector3d eye = ahead - Eigen::AngleAxisd(kAside_rad, axis) * ahead;
  view.camera_from_world = look_at(eye, ahead, Vector3d(0, -1, 0));
  return view;
}

// A bundle of what a frame shows, as the laparoscopy recipe makes it.
Player player_of(const TriangleMesh& surface, const std::optional<Lighting>& lighting) {
  const TriangleMesh proxy = decimate(surface, {.faces = 400}).proxy;
  PlacementOptions placement;
  placement.count = 5;
  placement.map_size = 512;
  placement.cone = ViewingCone{{0, 0, -1}, 0.35};
  Bundle bundle = memory_bundle(surface, proxy, placement);
  bundle.lighting = lighting;
  return Player(std::move(bundle));
}

// Against the phantom as it looks from there, where skin is drawn and nothing glitters.
double error_db(Player& player, const DrawOptions& options, const PosedCamera& view,
                const LaparoscopyFrame& truth) {
  Frame frame;
  player.draw(View{view}, options, frame);
  std::vector<std::uint8_t> shown(truth.depth_mm.size());
  for (std::size_t k = 0; k < shown.size(); ++k)
    shown[k] = frame.cover[k] != Cover::background && std::isfinite(truth.depth_mm.values[k]) &&
               !truth.highlights.values[k];
  return compare_images(frame.color, truth.image, shown).psnr_db;
}

TEST(Relit, LaparoscopyIsNearerTheTruthThanItsKeptLight) {
  LaparoscopyOptions options{.frames = 1, .instrument = false, .round_view = false};
  const LaparoscopyPhantom phantom(options);
  const LaparoscopyFrame seen = phantom.frame(0);
  const PreparedFrame frame = prepare_frame(seen.image, seen.camera.intrinsics, {});
  std::vector<float> depths = seen.depth_mm.values;
  std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
  ShadingOptions shading;
  shading.range_mm = depths[depths.size() / 2];
  const FrameDepth depth = shade_frame(frame, shading);
  const FrameAlbedo albedo = divide_light_out(frame, depth, shading.laparoscope, 1);
  const auto surface_in = [&](const Rgb8Image& color) {
    return mesh_from_depth(depth.depth, color, frame.camera, {});
  };
  Lighting lighting = laparoscope_lighting(shading.laparoscope);
  lighting.gloss.clear();  // highlights don't count here
  lighting.finish = {};
  Player kept = player_of(surface_in(frame.color), std::nullopt);
  Player relit = player_of(surface_in(albedo.color), lighting);
  double kept_db = 0, relit_db = 0;
  for (int place = 0; place < 5; ++place) {
    const PosedCamera view = aside(seen.camera.intrinsics, shading.range_mm, place);
    PosedCamera in_world = view;
    in_world.camera_from_world = view.camera_from_world * seen.camera.camera_from_world;
    const LaparoscopyFrame truth = phantom.frame_seen_by(
        in_world, in_world.center_world_mm(), 100000 * static_cast<std::uint64_t>(1 + place));
    DrawOptions drawing;
    kept_db += error_db(kept, drawing, view, truth) / 5;
    drawing.light = DrawnLight::scope;
    drawing.scope_reference_mm = albedo.reference_mm;
    relit_db += error_db(relit, drawing, view, truth) / 5;
  }
  expect({"laparoscopy from 5 views 20° aside: lit anew by the scope", "dB", relit_db, 0,
          Figure::Goal::at_least});
  expect({"laparoscopy from 5 views 20° aside: lit anew above the light kept", "dB",
          relit_db - kept_db, 6, Figure::Goal::at_least});
}

}  // namespace

}  // namespace organbake
