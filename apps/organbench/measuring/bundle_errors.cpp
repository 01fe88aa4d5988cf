// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/bundle_errors.h"

#include <cmath>

#include "measuring/material_picture.h"
#include "organbake/bundle/bundle.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/evaluation/frame_errors.h"
#include "organbake/image/difference.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

double mean_square_levels(Player& player, MaterialPicture truth, const View& view) {
  DrawOptions options;
  options.background = {0, 0, 0};
  Frame frame;
  player.draw(view, options, frame);
  for (std::size_t i = 0; i < truth.covered.size(); ++i)
    truth.covered[i] |= frame.cover[i] != Cover::background;
  const double psnr_db = compare_images(frame.color, truth.color, truth.covered).psnr_db;
  return 255 * 255 * std::pow(10.0, -psnr_db / 10);
}

double picture_error_levels(const std::filesystem::path& bundle, const TriangleMesh& surface,
                            const std::vector<View>& views) {
  Player player(bundle);
  const MaterialTruth truth(surface);
  double sum = 0;
  for (const View& view : views) sum += mean_square_levels(player, truth.draw(view.camera), view);
  return std::sqrt(sum / double(views.size()));
}

double rms_to_proxy_mm(const TriangleMesh& surface, const TriangleMesh& proxy) {
  const RayScene scene(proxy);
  double squares = 0;
  for (const Eigen::Vector3d& v : surface.vertices)
    squares += std::pow(scene.closest_point(v).distance_mm, 2);
  return std::sqrt(squares / double(surface.vertices.size()));
}

}  // namespace

Quantities bundle_errors(const std::filesystem::path& folder, int height_px) {
  const BundleReader reader(folder);
  const Bundle bundle = reader.read_all();
  const TriangleMesh surface = reader.read_surface();
  std::vector<View> views;
  for (const OrbitPose& pose : {OrbitPose{0.2, 0.1}, OrbitPose{1.5, -0.4}, OrbitPose{3.4, 0.6}})
    views.push_back(orbit_view(bundle.cameras, pose, height_px * 16 / 9, height_px));
  const CarriedSurface truth(surface, bundle.shell());
  const ProjectionErrors projection =
      ProjectionComparison(bundle, truth).measure(bundle.proxy.vertices, views.front());
  return {{"pictures of " + std::to_string(height_px) + "p against 16 rays a pixel, RMS", "levels",
           picture_error_levels(folder, surface, views)},
          {"vertices projected, mean error", "px", projection.image_based.mean_px},
          {"the same by the proxy's polygons", "px", projection.polygons.mean_px},
          {"vertices to the proxy, RMS", "mm", rms_to_proxy_mm(surface, bundle.proxy)}};
}

}  // namespace organbake
