// SPDX-License-Identifier: GPL-3.0-or-later
#include "appearance/prediction.h"

#include "cost_functions/cost_functions.h"
#include "lamp_studio.h"
#include "organbake/core/random.h"
#include "organbake/geometry/refine.h"
#include "organbake/registration/register_photo.h"
#include "support/testing.h"

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
  ShadingBasis basis{LightModel::camera, 120};
  ShadingBasis::Weights weights = basis.first_weights();

  Prediction at(const Motion& motion, double log_focal = 0) const {
    Prediction p;
    predict(surface, level, moved(pose, motion), std::exp(log_focal), basis, weights, {.margin = 8},
            p);
    return p;
  }
};

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

using Eigen::Vector3d;

ShadingBasis::Weights some_weights() {
  ShadingBasis::Weights weights;
  for (int j = 0; j < ShadingBasis::kMost; ++j) weights[j] = 0.3 + 0.17 * j * (j % 2 ? 1 : -1);
  weights[0] = 1.2;
  return weights;
}

double radiance(const ShadingBasis& basis, const Vector3d& x, const Vector3d& n) {
  double phi[ShadingBasis::kMost];
  basis.values(x, n, phi);
  return Eigen::VectorXd::Map(phi, basis.size()).dot(some_weights().head(basis.size()));
}

TEST(ShadingBasis, GradientIsTheFiniteDifferences) {
  const Vector3d x(20, -35, 260), n = Vector3d(0.3, 0.2, -0.9).normalized();
  for (const LightModel model : {LightModel::camera, LightModel::beam, LightModel::estimated}) {
    const ShadingBasis basis(model, 250);
    const auto g = basis.gradient(x, n, some_weights());
    constexpr double kStep = 1e-5;
    for (int j = 0; j < 3; ++j) {
      const Vector3d step = kStep * Vector3d::Unit(j);
      const double by_x =
          (radiance(basis, x + step, n) - radiance(basis, x - step, n)) / (2 * kStep);
      const double by_n =
          (radiance(basis, x, n + step) - radiance(basis, x, n - step)) / (2 * kStep);
      EXPECT_NEAR(g.by_point[j], by_x, 1e-7) << int(model) << " axis " << j;
      EXPECT_NEAR(g.by_normal[j], by_n, 1e-7) << int(model) << " axis " << j;
    }
  }
}

TEST(ShadingBasis, LampAtTheCameraIsOneFacingItAtTheReference) {
  const ShadingBasis basis(LightModel::camera, 200);
  double phi[ShadingBasis::kMost];
  basis.values({0, 0, 200}, {0, 0, -1}, phi);
  EXPECT_DOUBLE_EQ(phi[0], 1);
  basis.values({0, 0, 400}, {0, 0, -1}, phi);
  EXPECT_DOUBLE_EQ(phi[0], 0.25) << "falls with the distance squared";
  basis.values({0, 0, 200}, {0, 0, 1}, phi);
  EXPECT_DOUBLE_EQ(phi[0], 0) << "lights no back";
}

RegisteredPhoto found_under(const PhotoLight& light, std::uint64_t seed) {
  const LampStudio& studio = lamp_studio();
  const LampScene scene{false, false, light};
  PhotoToRegister photo = studio.photo(
      picture_of_mesh_by_lamp(studio.surface.mesh(), studio.cameras[0], scene), {.noise = 0.01});
  photo.start = disturbed(studio.surface, studio.cameras[0].camera_from_world, 5, 5, seed);
  return register_photo(studio.surface, photo, {});
}

double lit_error_mm(const RegisteredPhoto& found) {
  return lamp_studio().surface.mean_distance_mm(lamp_studio().cameras[0].camera_from_world,
                                                found.camera.camera_from_world);
}

constexpr double kRight_mm = 0.25;  // a quarter of a pixel

TEST(LightChoice, TheLampAtTheLensIsTakenForWhatItIs) {
  const auto found = found_under({}, 1);
  EXPECT_EQ(found.light, LightModel::camera) << name_of(found.light);
  EXPECT_LT(lit_error_mm(found), kRight_mm);
}

TEST(LightChoice, ABeamBesideTheLensIsNot) {
  PhotoLight light;
  light.lamp_camera_mm = {9, -4, 0};
  light.beam_exponent = 5;
  const auto found = found_under(light, 2);
  EXPECT_NE(found.light, LightModel::camera);
  EXPECT_LT(lit_error_mm(found), kRight_mm);
  EXPECT_EQ(found.quality.verdict, Verdict::ok) << found.quality.reason;
}

TEST(LightChoice, LightFromAfarIsEstimated) {
  PhotoLight light;
  light.toward = {0.6, -0.5, -1};
  const auto found = found_under(light, 3);
  EXPECT_EQ(found.light, LightModel::estimated) << name_of(found.light);
  EXPECT_LT(lit_error_mm(found), kRight_mm);
  EXPECT_EQ(found.quality.verdict, Verdict::ok) << found.quality.reason;
}

TEST(LightChoice, WhatIsGivenStands) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start = lamp_studio().cameras[0].camera_from_world;
  RegistrationOptions options;
  options.light = LightModel::beam;
  EXPECT_EQ(register_photo(lamp_studio().surface, photo, options).light, LightModel::beam);
}

struct Values {
  std::vector<double> a, weights;
  Eigen::VectorXd b;
};

Values random_values(int count, std::uint64_t seed) {
  RandomStream random(seed);
  Values values{std::vector<double>(count), std::vector<double>(count), Eigen::VectorXd(count)};
  for (int i = 0; i < count; ++i) {
    values.a[i] = random.uniform();
    values.weights[i] = random.uniform();
    values.b[i] = 0.5 * values.a[i] + random.uniform();
  }
  return values;
}

// The paper's R, with weights, straight from its definition.
double plain_correlation(const Values& v) {
  double w = 0, ma = 0, mb = 0, ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < v.a.size(); ++i) {
    w += v.weights[i];
    ma += v.weights[i] * v.a[i];
    mb += v.weights[i] * v.b[i];
  }
  ma /= w;
  mb /= w;
  for (std::size_t i = 0; i < v.a.size(); ++i) {
    ab += v.weights[i] * (v.a[i] - ma) * (v.b[i] - mb);
    aa += v.weights[i] * (v.a[i] - ma) * (v.a[i] - ma);
    bb += v.weights[i] * (v.b[i] - mb) * (v.b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

constexpr double kRounding = 1e-12;

TEST(NccBlock, HalfTheSquaredResidualIsOneMinusR) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Values v = random_values(500, seed);
    const NccBlock block(v.a, v.weights);
    Eigen::VectorXd r(500);
    const double correlation = block.correlate(v.b, r.data());
    EXPECT_NEAR(correlation, plain_correlation(v), kRounding);
    EXPECT_NEAR(0.5 * r.squaredNorm(), 1 - correlation, kRounding);
  }
}

TEST(NccBlock, DerivativeIsTheFiniteDifferences) {
  const Values v = random_values(200, 5);
  const NccBlock block(v.a, v.weights);
  const Eigen::VectorXd way = random_values(200, 6).b;
  NccBlock::RowMajor derivative(200, 1);
  derivative.col(0) = way;
  block.to_residual_derivative(v.b, derivative);
  constexpr double kStep = 1e-5;  // central: its error is of the order of the step squared
  Eigen::VectorXd before(200), after(200);
  block.correlate(v.b - kStep * way, before.data());
  block.correlate(v.b + kStep * way, after.data());
  EXPECT_LT(((after - before) / (2 * kStep) - derivative.col(0)).norm(),
            1e-8 * derivative.norm() + 1e-10);
}

}  // namespace
}  // namespace organbake
