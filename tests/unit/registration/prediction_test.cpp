// SPDX-License-Identifier: GPL-3.0-or-later
#include "appearance/prediction.h"

#include <gtest/gtest.h>

#include "appearance/appearance.h"
#include "lamp_studio.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

// An egg: smooth, so that what differs from finite differences is the derivative's own fault.
TriangleMesh egg() {
  TriangleMesh mesh = make_icosphere(6);
  for (Eigen::Vector3d& v : mesh.vertices) v = Eigen::Vector3d(30 * v.x(), 22 * v.y(), 17 * v.z());
  return mesh;
}

PhotoLevel empty_level(int size) {
  PhotoLevel level;
  level.intrinsics = {size, size, 1.5 * size, 1.5 * size, size / 2.0 + 3, size / 2.0 - 2};
  level.luminance.assign(std::size_t(size) * size, 0);
  level.valid.assign(std::size_t(size) * size, 1);
  level.rays = pixel_rays(level.intrinsics);
  return level;
}

struct Scene {
  RegisteredSurface surface{egg()};
  PhotoLevel level = empty_level(200);
  ObjectPose pose{Eigen::Quaterniond(0.9, 0.2, -0.3, 0.1).normalized(), {4, -3, 120}};
  ShadingBasis basis{{LightModel::camera, -Eigen::Vector3d::UnitZ(), 0}, 120};
  ShadingBasis::Weights weights = basis.first_weights();

  Prediction at(const Motion& motion, double log_focal = 0) const {
    Prediction p;
    predict(surface, level, moved(pose, motion), std::exp(log_focal), basis, weights, {.margin = 8},
            p);
    return p;
  }
};

TEST(Prediction, CoversWhatTheSurfaceCovers) {
  const Scene scene;
  const Prediction p = scene.at(Motion::Zero());
  const RigidTransform camera_from_world = rigid_transform(scene.pose, scene.surface.center());
  for (const SurfaceSample& sample : scene.surface.samples()) {
    const Eigen::Vector2d pixel = project(scene.level.intrinsics, camera_from_world * sample.point);
    const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
    ASSERT_TRUE(p.contains(x, y));
    // The outline crosses some pixels between the eight rays that ask about them.
    float most = 0;
    for (int v = y - 1; v <= y + 1; ++v)
      for (int u = x - 1; u <= x + 1; ++u) most = std::max(most, p.coverage[p.index(u, v)]);
    EXPECT_GT(most, 0);
  }
}

// Pixel gradient × projection × pose, plus the shading's own change, against redrawing.
TEST(Prediction, DerivativeIsTheFiniteDifferences) {
  const Scene scene;
  const Prediction p = scene.at(Motion::Zero());
  const double steps[] = {2e-3, 2e-3, 2e-3, 0.1, 0.1, 0.5, 2e-3};  // about a third of a pixel
  for (int j = 0; j < 7; ++j) {
    const Motion step = j < 6 ? Motion(steps[j] * Motion::Unit(j)) : Motion(Motion::Zero());
    const double focal = j == 6 ? steps[6] : 0;
    const Prediction more = scene.at(step, focal), less = scene.at(-step, -focal);
    double product = 0, analytic2 = 0, difference2 = 0;
    for (int y = p.top; y < p.top + p.height; ++y)
      for (int x = p.left; x < p.left + p.width; ++x) {
        if (!more.contains(x, y) || !less.contains(x, y)) continue;
        const double difference =
            (more.radiance[more.index(x, y)] - less.radiance[less.index(x, y)]) / (2 * steps[j]);
        const double analytic =
            pixel_derivative(p, scene.level.intrinsics, scene.pose.center_camera_mm, scene.basis,
                             scene.weights, x, y)[j];
        product += analytic * difference;
        analytic2 += analytic * analytic;
        difference2 += difference * difference;
      }
    // Central differences of the picture smooth its outline over two pixels: the derivative is that
    // much lower there, hence the tolerance; its direction must be right.
    EXPECT_GT(product / std::sqrt(analytic2 * difference2), 0.94) << "parameter " << j;
    EXPECT_NEAR(std::sqrt(analytic2 / difference2), 1, 0.12) << "parameter " << j;
  }
}

TEST(Prediction, InsideTheOutlineTheDerivativeIsExact) {
  const Scene scene;
  const Prediction p = scene.at(Motion::Zero());
  const double steps[] = {1e-3, 1e-3, 1e-3, 0.05, 0.05, 0.2};
  for (int j = 0; j < 6; ++j) {
    const Motion step = steps[j] * Motion::Unit(j);
    const Prediction more = scene.at(step), less = scene.at(-step);
    double error2 = 0, size2 = 0;
    for (int y = p.top + 1; y < p.top + p.height - 1; ++y)
      for (int x = p.left + 1; x < p.left + p.width - 1; ++x) {
        // Away from the outline, where the surface is far from grazing.
        if (p.radiance[p.index(x, y)] < 0.5f || p.coverage[p.index(x, y)] < 1) continue;
        const double difference =
            (more.radiance[more.index(x, y)] - less.radiance[less.index(x, y)]) / (2 * steps[j]);
        const double analytic =
            pixel_derivative(p, scene.level.intrinsics, scene.pose.center_camera_mm, scene.basis,
                             scene.weights, x, y)[j];
        error2 += (analytic - difference) * (analytic - difference);
        size2 += difference * difference;
      }
    // Faces of 1 mm: the interpolated normals' slope jumps from one to the next.
    EXPECT_LT(std::sqrt(error2 / size2), 0.03) << "parameter " << j;
  }
}

TEST(Prediction, SlidAlongKeptFacesIsTheTracedOne) {
  const Scene scene;
  Motion motion;
  motion << 2e-3, -1e-3, 1e-3, 0.05, -0.05, 0.1;
  Prediction kept = scene.at(Motion::Zero());
  predict(scene.surface, scene.level, moved(scene.pose, motion), 1, scene.basis, scene.weights,
          {.keep_faces = true}, kept);
  const Prediction traced = scene.at(motion);
  double error2 = 0, size2 = 0;
  for (int y = traced.top; y < traced.top + traced.height; ++y)
    for (int x = traced.left; x < traced.left + traced.width; ++x) {
      if (!kept.contains(x, y)) continue;
      const double value = traced.radiance[traced.index(x, y)];
      error2 += std::pow(kept.radiance[kept.index(x, y)] - value, 2);
      size2 += value * value;
    }
  EXPECT_LT(std::sqrt(error2 / size2), 1e-3) << "but for which outline pixels are split";
}

TEST(Overlap, HoldsTheOrganAndItsBandOnly) {
  Scene scene;
  const Prediction p = scene.at(Motion::Zero());
  scene.level.valid[scene.level.index(103, 98)] = 0;
  std::size_t covered = 0;
  for (const float c : p.coverage) covered += c > 0;
  const auto none = overlap(scene.level, p, 0), band = overlap(scene.level, p, 3);
  EXPECT_EQ(none.size(), covered - 1) << "one pixel does not count";
  EXPECT_GT(band.size(), covered + 3 * 200);
  for (const WeightedPixel& pixel : band) EXPECT_TRUE(p.contains(pixel.x, pixel.y));
}

}  // namespace
}  // namespace organbake
