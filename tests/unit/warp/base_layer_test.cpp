// SPDX-License-Identifier: Apache-2.0
// What a frame shows where the cameras saw nothing, and how close it comes to the formula
// elsewhere.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "organbake/geometry/shell_map.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/warper.h"
#include "support/synthetic_bundle.h"
#include "views_round.h"

namespace organbake {
namespace {

SyntheticOptions lumpy_base_options() {
  SyntheticOptions options;
  options.organ.lump_share = 0.05;
  options.map_size = 192;
  options.base_step_mm = 1.5;
  return options;
}

const Bundle& lumpy_bundle() {
  static const Bundle bundle = make_synthetic_bundle(lumpy_base_options());
  return bundle;
}

// The organ by its formula, 3×3 rays a pixel; covered where all of them hit.
struct Formula {
  Rgb8Image color;
  std::vector<std::uint8_t> inside;
};

Formula trace_formula(const SyntheticOrgan& organ, const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  const RigidTransform world_from_camera = view.camera.camera_from_world.inverse();
  Formula formula{Rgb8Image(k.width, k.height),
                  std::vector<std::uint8_t>(std::size_t(k.width) * k.height, 0)};
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      int hits = 0;
      for (int ray = 0; ray < 9; ++ray) {
        const Eigen::Vector3d direction((x + (ray % 3 + 0.5) / 3 - k.cx) / k.fx,
                                        (y + (ray / 3 + 0.5) / 3 - k.cy) / k.fy, 1);
        const Eigen::Vector3d origin = world_from_camera.translation;
        const Eigen::Vector3d along = world_from_camera.rotation * direction;
        const double t = organ.trace(origin, along);
        if (!std::isfinite(t)) continue;
        sum += organ.color(origin + t * along);
        ++hits;
      }
      if (hits < 9) continue;
      formula.inside[std::size_t(y) * k.width + x] = 1;
      for (int c = 0; c < 3; ++c) formula.color.at(x, y)[c] = srgb8_from_linear(sum[c] / 9);
    }
  }
  return formula;
}

// Makes a bundle whose cameras saw nothing within a ball.
void hide_from_cameras(Bundle& bundle, const Eigen::Vector3d& middle, double radius_mm) {
  const auto hidden = [&](const Eigen::Vector3d& p) { return (p - middle).norm() < radius_mm; };
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    CameraMaps& maps = bundle.maps[c];
    const PosedCamera& camera = bundle.cameras.cameras[c];
    const RigidTransform world_from_camera = camera.camera_from_world.inverse();
    for (std::size_t i = 0; i < maps.face.size(); ++i) {
      if (maps.face[i] == kNoFace) continue;
      const Eigen::Vector2d pixel(double(i % maps.width) + 0.5, double(i / maps.width) + 0.5);
      const Eigen::Vector3d p =
          world_from_camera * (double(maps.depth_mm[i]) * unproject(camera.intrinsics, pixel));
      if (hidden(p)) maps.face[i] = kNoFace, maps.confidence[i] = 0;
    }
  }
  BaseLayer& base = bundle.base;
  const std::vector<Eigen::Vector3d> normals = vertex_normals(bundle.proxy);
  for (std::uint32_t f = 0; f < base.face_count; ++f) {
    const ShellMatrix shell = shell_matrix(bundle.proxy, normals, f);
    for (std::uint32_t i = 0; i <= base.steps; ++i) {
      for (std::uint32_t j = 0; i + j <= base.steps; ++j) {
        const std::size_t node =
            std::size_t(f) * base.nodes_per_face() + base_node_index(base.steps, i, j);
        const Eigen::Vector3d p = shell_point(shell, double(i) / base.steps, double(j) / base.steps,
                                              base.height_mm[node]);
        if (hidden(p)) base.seen_by[node] = 0;
      }
    }
  }
}

const Eigen::Vector3d kBetweenCameras(0.5, -1, 0.4);

TEST(WarpedFrame, ComesCloseToTheFormula) {
  const Bundle& bundle = lumpy_bundle();
  const View view = view_from(bundle, kBetweenCameras, 256);
  const Formula truth = trace_formula(lumpy_base_options().organ, view);
  Frame frame;
  Warper(bundle).draw(bundle.proxy.vertices, view, {}, frame);
  // One sample a pixel against nine: texture of 3 mm at 0.6 mm a pixel leaves about 36 dB.
  constexpr double kLeastDb = 33;
  EXPECT_GT(compare_images(frame.color, truth.color, truth.inside).psnr_db, kLeastDb);
}

TEST(BaseLayer, TakesOverWhereNoCameraSawTheSkin) {
  Bundle bundle = lumpy_bundle();
  const View view = view_from(bundle, kBetweenCameras, 256);
  const Formula truth = trace_formula(lumpy_base_options().organ, view);
  const Eigen::Vector3d towards_eye = kBetweenCameras.normalized();
  const SyntheticOrgan organ = lumpy_base_options().organ;
  hide_from_cameras(bundle, organ.center + organ.radius(towards_eye) * towards_eye, 15);
  Warper warper(bundle);
  Frame frame;
  const DrawReport with = warper.draw(bundle.proxy.vertices, view, {}, frame);
  EXPECT_GT(with.base_pixels, 1000u);
  EXPECT_EQ(with.holes_after, 0u);
  std::vector<std::uint8_t> shown_by_base = truth.inside;
  for (std::size_t i = 0; i < shown_by_base.size(); ++i) {
    EXPECT_TRUE(!truth.inside[i] || frame.cover[i] != Cover::background);
    shown_by_base[i] &= frame.cover[i] == Cover::base;
  }
  // Gouraud shading between nodes 1.5 mm apart.
  constexpr double kLeastDb = 26;
  EXPECT_GT(compare_images(frame.color, truth.color, shown_by_base).psnr_db, kLeastDb);

  DrawOptions without;
  without.base_layer = false;
  warper.draw(bundle.proxy.vertices, view, without, frame);
  std::size_t open = 0;
  for (std::size_t i = 0; i < truth.inside.size(); ++i) {
    open += truth.inside[i] && frame.cover[i] == Cover::background;
  }
  EXPECT_GT(open, 1000u);
}

}  // namespace
}  // namespace organbake
