// SPDX-License-Identifier: GPL-3.0-or-later

#include <ceres/ceres.h>

#include "cost_functions/cost_functions.h"
#include "lamp_studio.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/formats/photo.h"
#include "organbake/registration/registered_surface.h"
#include "pose/poses.h"
#include "support/meshes.h"
#include "support/places.h"
#include "support/testing.h"

namespace organbake {
namespace {

// The light that the photographs were taken in; and what fallbacks find is doubtful at best, so
// that they have no part in what must not be ok. Every light has its turn in tests/acceptance.
RegistrationOptions without_fallbacks() {
  RegistrationOptions options;
  options.fallbacks = false;
  options.light = LightModel::camera;
  return options;
}

PhotoToRegister near_start(std::uint64_t seed) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start =
      disturbed(lamp_studio().surface, lamp_studio().cameras[0].camera_from_world, 5, 5, seed);
  return photo;
}

TEST(Verdict, AMirroredMeshIsNotOk) {
  const TriangleMesh& organ = lamp_studio().surface.mesh();
  const RegisteredSurface surface(moved(mirrored(organ), {2 * bounds(organ).center().x(), 0, 0}));
  PhotoToRegister photo = near_start(1);
  EXPECT_NE(register_photo(surface, photo, without_fallbacks()).quality.verdict, Verdict::ok);
}

TEST(Verdict, AnotherOrganIsNotOk) {
  // The same lobes in other proportions: within 5 mm of each other, so it takes a photograph in
  // which that shows.
  OrganPhantomOptions options;
  options.photo_count = 8;
  options.photo_size = 512;
  const PosedCamera camera = OrganPhantom(options).photo_cameras().front();
  options.seed = 2;
  TriangleMesh other = OrganPhantom(options).surface(5);
  other.colors.clear();
  const RegisteredSurface surface(other);
  PhotoToRegister photo;
  photo.image =
      develop(picture_by_lamp(lamp_studio().phantom, lamp_studio().surface.mesh(), camera, {}), {});
  photo.intrinsics = camera.intrinsics;
  photo.start = camera.camera_from_world;
  const auto found = register_photo(surface, photo, without_fallbacks());
  EXPECT_NE(found.quality.verdict, Verdict::ok);
  EXPECT_GT(found.quality.correlation, 0.9) << "R alone would have been taken in";
}

TEST(Verdict, AWrongFocalLengthIsNotOk) {
  for (const double factor : {0.8, 1.2}) {
    PhotoToRegister photo = near_start(3);
    photo.intrinsics.fx *= factor;
    photo.intrinsics.fy *= factor;
    const auto found = register_photo(lamp_studio().surface, photo, without_fallbacks());
    EXPECT_NE(found.quality.verdict, Verdict::ok) << factor;
    EXPECT_FALSE(found.quality.reason.empty());
  }
}

TEST(Verdict, AStartBeyondReachIsOkOnlyWhenThePoseIsFoundAllTheSame) {
  const RigidTransform truth = lamp_studio().cameras[0].camera_from_world;
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start = disturbed(lamp_studio().surface, truth, 40, 150, 4);
  const auto found = register_photo(lamp_studio().surface, photo, without_fallbacks());
  const double error_mm =
      lamp_studio().surface.mean_distance_mm(truth, found.camera.camera_from_world);
  EXPECT_EQ(found.quality.verdict == Verdict::ok, error_mm < 1) << error_mm << " mm";
}

TEST(Verdict, AnOrganMostlyOutOfThePictureFails) {
  PhotoToRegister photo = near_start(5);
  photo.mask = Rgb8Image(photo.image.width, photo.image.height);
  for (int y = 0; y < photo.image.height; ++y)
    for (int x = 0; x < 110; ++x) std::fill_n(photo.mask.at(x, y), 3, 255);
  const auto found = register_photo(lamp_studio().surface, photo, without_fallbacks());
  EXPECT_EQ(found.quality.verdict, Verdict::failed);
}

// Of almost all of the outline nothing beyond the organ counts: what is left confirms the pose by
// chance as easily as not.
TEST(Verdict, AnOutlineThatHardlyShowsConfirmsNothing) {
  PhotoToRegister photo = near_start(6);
  const PosedCamera& camera = lamp_studio().cameras[0];
  const int width = photo.image.width, height = photo.image.height;
  photo.mask = Rgb8Image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Ray ray;
      ray.origin = camera.center_world_mm();
      ray.direction = camera.camera_from_world.rotation.transpose() *
                      unproject(camera.intrinsics, {x + 0.5, y + 0.5});
      std::uint8_t organ = 0;
      lamp_studio().surface.scene().occluded({&ray, 1}, {&organ, 1});
      const bool window = std::abs(x - width / 2) < width / 8 && y < height / 2;
      if (organ || window) std::fill_n(photo.mask.at(x, y), 3, 255);
    }
  const auto found = register_photo(lamp_studio().surface, photo, without_fallbacks());
  EXPECT_GT(found.quality.outline_asked_share, 0) << found.quality.reason;
  EXPECT_LT(found.quality.outline_asked_share, 0.2);
  EXPECT_NE(found.quality.verdict, Verdict::ok) << found.quality.outline_share;
}

using Eigen::Vector3d;

Intrinsics lens(bool distorted) {
  Intrinsics k{640, 480, 700, 690, 322, 241};
  if (distorted) {
    k.k1 = -0.2;
    k.k2 = 0.05;
    k.p1 = 0.001;
    k.p2 = -0.002;
    k.k3 = 0.01;
  }
  return k;
}

ObjectPose some_pose() {
  ObjectPose pose;
  pose.camera_from_world = Eigen::Quaterniond(0.5, -0.3, 0.7, 0.2).normalized();
  pose.center_camera_mm = {12, -7, 300};
  return pose;
}

TEST(ObjectPose, MotionBetweenIsWhatMoved) {
  Motion motion;
  motion << 0.3, -0.5, 0.2, 4, -2, 7;
  EXPECT_LT((motion_between(some_pose(), moved(some_pose(), motion)) - motion).norm(), 1e-12);
}

TEST(ObjectPose, PixelMotionIsTheFiniteDifferences) {
  for (const bool distorted : {false, true}) {
    const Intrinsics k = lens(distorted);
    const ObjectPose pose = some_pose();
    const Vector3d from_center(25, 40, -30);
    const auto pixel = [&](const Motion& motion) {
      const ObjectPose at = moved(pose, motion);
      return project(k, at.camera_from_world * from_center + at.center_camera_mm);
    };
    const Vector3d x = pose.camera_from_world * from_center + pose.center_camera_mm;
    const auto analytic = pixel_motion(k, x, pose.center_camera_mm);
    constexpr double kStep = 1e-5;
    for (int j = 0; j < 6; ++j) {
      const Motion step = kStep * Motion::Unit(j);
      const Eigen::Vector2d difference = (pixel(step) - pixel(-step)) / (2 * kStep);
      EXPECT_LT((difference - analytic.col(j)).norm(), 1e-6 * (1 + analytic.col(j).norm()))
          << "parameter " << j << (distorted ? ", distorted" : "");
    }
  }
}

using Numbers = Eigen::Matrix<double, 7, 1>;

TEST(ObjectPose, MotionByNumbersIsTheFiniteDifferences) {
  const auto numbers = [](const Motion& motion) -> Numbers {
    return Numbers::Map(moved(some_pose(), motion).to_array().data());
  };
  const Numbers at = numbers(Motion::Zero());
  constexpr double kStep = 1e-6;
  for (int j = 0; j < 6; ++j) {
    const Motion step = kStep * Motion::Unit(j);
    const Numbers change = (numbers(step) - numbers(-step)) / (2 * kStep);
    EXPECT_LT((motion_by_numbers(at.data()) * change - Motion::Unit(j)).norm(), 1e-8) << j;
  }
}

const Intrinsics kLens{800, 600, 900, 910, 405, 296, -0.1, 0.02};

RigidTransform pairs_truth() { return look_at({150, -220, 90}, {5, 3, -4}, {0, 0, 1}); }

std::vector<PointPair> pairs(int count, double noise_px) {
  RandomStream random(11);
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    PointPair pair;
    pair.point_world_mm = {random.uniform(-50, 50), random.uniform(-50, 50),
                           random.uniform(-50, 50)};
    pair.pixel = project(kLens, pairs_truth() * pair.point_world_mm) +
                 noise_px * Eigen::Vector2d(random.normal(), random.normal());
    pairs.push_back(pair);
  }
  return pairs;
}

TEST(PosePairs, ExactPairsGiveTheExactPose) {
  const RigidTransform found = pose_from_pairs(pairs(6, 0), kLens);
  EXPECT_LT((found.rotation - pairs_truth().rotation).norm(), 1e-6);
  EXPECT_LT((found.translation - pairs_truth().translation).norm(), 1e-4);
}

TEST(PosePairs, OneWrongClickHardlyMatters) {
  std::vector<PointPair> clicked = pairs(12, 0.5);
  clicked[4].pixel += Eigen::Vector2d(60, -40);
  const RigidTransform found = pose_from_pairs(clicked, kLens);
  EXPECT_LT((found.rotation - pairs_truth().rotation).norm(), 0.02);
  EXPECT_LT((found.translation - pairs_truth().translation).norm(), 3) << "mm, from 270 mm away";
}

TEST(PosePairs, TooFewOrFlatOnesAreRefused) {
  EXPECT_THROW(pose_from_pairs(pairs(5, 0), kLens), UsageError);
  std::vector<PointPair> flat = pairs(8, 0);
  for (PointPair& pair : flat) {
    pair.point_world_mm.z() = 0;
    pair.pixel = project(kLens, pairs_truth() * pair.point_world_mm);
  }
  EXPECT_THROW(pose_from_pairs(flat, kLens), UsageError);
}

PhotoToRegister grey(int size, int value) {
  PhotoToRegister photo;
  photo.image = Rgb8Image(size, size);
  std::fill(photo.image.pixels.begin(), photo.image.pixels.end(), value);
  photo.intrinsics = {size, size, 1.5 * size, 1.5 * size, size / 2.0, size / 2.0};
  return photo;
}

RigidTransform in_front() { return lamp_studio().cameras[0].camera_from_world; }

TEST(RegisterStress, PhotographsThatTellNothingFail) {
  RegistrationOptions one_light;  // each searches all round
  one_light.light = LightModel::camera;
  EXPECT_EQ(register_photo(lamp_studio().surface, grey(32, 128), one_light).quality.verdict,
            Verdict::failed);
  for (const int value : {0, 128, 255}) {
    PhotoToRegister photo = grey(value == 128 ? 32 : 16, value);
    photo.start = in_front();
    const auto found = register_photo(lamp_studio().surface, photo, {});
    EXPECT_EQ(found.quality.verdict, Verdict::failed) << value;
    EXPECT_FALSE(found.quality.reason.empty());
  }
}

TEST(RegisterStress, TinyPhotographsFail) {
  RegistrationOptions one_light;
  one_light.light = LightModel::camera;
  for (const int size : {1, 8, 9}) {
    PhotoToRegister photo = grey(size, 100);
    *photo.image.at(size / 2, size / 2) = 200;
    EXPECT_NE(register_photo(lamp_studio().surface, photo, one_light).quality.verdict, Verdict::ok);
    photo.start = in_front();
    EXPECT_NE(register_photo(lamp_studio().surface, photo, {}).quality.verdict, Verdict::ok);
  }
}

// A start that is no start: the search may find the organ all the same, but may not take another
// place for it.
void expect_right_or_not_ok(const PhotoToRegister& photo) {
  RegistrationOptions options;
  options.light = LightModel::camera;
  const auto found = register_photo(lamp_studio().surface, photo, options);
  const double error_mm =
      lamp_studio().surface.mean_distance_mm(in_front(), found.camera.camera_from_world);
  EXPECT_EQ(found.quality.verdict == Verdict::ok, error_mm < 1) << error_mm << " mm";
}

TEST(RegisterStress, AMeshBehindTheCameraIsFoundOrFails) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start = in_front();
  photo.start->translation.z() -= 2000;
  expect_right_or_not_ok(photo);
  // Where the organ does not stand out from its ground there is nothing to go by.
  for (std::size_t i = 0; i < photo.image.pixels.size(); ++i)
    photo.image.pixels[i] = static_cast<std::uint8_t>(40 + (i * 2654435761u >> 7) % 120);
  EXPECT_EQ(register_photo(lamp_studio().surface, photo, {}).quality.verdict, Verdict::failed);
}

TEST(RegisterStress, ACameraInsideTheMeshIsFoundOrNotOk) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start = in_front();
  photo.start->translation -= *photo.start * lamp_studio().surface.center();
  expect_right_or_not_ok(photo);
}

TEST(RegisterStress, OneTriangleEnds) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {50, 0, 0}, {0, 50, 0}};
  mesh.faces = {{0, 1, 2}};
  const RegisteredSurface surface(mesh);
  const PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  EXPECT_NE(register_photo(surface, photo, {}).quality.verdict, Verdict::ok);
  mesh.vertices[2] = {100, 0, 0};  // and one without area
  EXPECT_THROW(RegisteredSurface{mesh}, BadDataError);
}

TEST(RegisterStress, BadInputIsRefused) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.intrinsics.fx = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(register_photo(lamp_studio().surface, photo, {}), BadDataError);
  photo = lamp_studio().photo(lamp_studio().plain);
  photo.intrinsics.width += 1;
  EXPECT_THROW(register_photo(lamp_studio().surface, photo, {}), BadDataError);
  photo = lamp_studio().photo(lamp_studio().plain);
  photo.mask = Rgb8Image(3, 3);
  EXPECT_THROW(register_photo(lamp_studio().surface, photo, {}), BadDataError);
  EXPECT_THROW(RegisteredSurface{TriangleMesh{}}, BadDataError);
}

TEST(RegistrationOptions, CheckThemselves) {
  RegistrationOptions().check();
  RegistrationOptions options;
  options.finest_side_px = 63;
  EXPECT_THROW(options.check(), UsageError);
}

namespace fs = std::filesystem;

Eigen::Matrix4d read_matrix(const fs::path& path) {
  std::ifstream file(path);
  Eigen::Matrix4d m;
  for (int i = 0; i < 16; ++i) file >> m(i / 4, i % 4);
  return m;
}

RigidTransform rigid(const Eigen::Matrix4d& m) {
  return {m.topLeftCorner<3, 3>(), m.topRightCorner<3, 1>()};
}

// A rendering of VTK's with a lamp at the camera that does not fall off, on a cluttered background,
// partly out of the picture; pieces of the mesh are inside out.
class RegisterRenderedLiver : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(shared_data("registration/rendered_liver"))) {
      GTEST_SKIP() << "REAL DATA MISSING: " << shared_data("registration/rendered_liver");
    }
    surface_.emplace(read_mesh(shared_data("registration/rendered_liver/liver-H07.ply")));
    photo_.image = read_photo(shared_data("registration/rendered_liver/synthetic-left.png"));
    photo_.intrinsics = {1920, 1080, 2012.186314, 2017.966019, 944.7173708, 617.1093984};
    truth_ = rigid(read_matrix(shared_data("registration/rendered_liver/camera_to_world.txt")))
                 .inverse() *
             rigid(read_matrix(shared_data("registration/rendered_liver/model_to_world.txt")));
  }

  RegisteredPhoto expect_found() const {
    RegistrationOptions options;
    options.light = LightModel::estimated;
    options.finest_side_px = 500;
    const auto found = register_photo(*surface_, photo_, options);
    EXPECT_LT(surface_->mean_distance_mm(truth_, found.camera.camera_from_world), 1);
    const Eigen::AngleAxisd turn(found.camera.camera_from_world.rotation *
                                 truth_.rotation.transpose());
    EXPECT_LT(turn.angle() * 180 / std::numbers::pi, 0.5);
    return found;
  }

  std::optional<RegisteredSurface> surface_;
  PhotoToRegister photo_;
  RigidTransform truth_;
};

TEST_F(RegisterRenderedLiver, FromAStartFarOff) {
  photo_.start = disturbed(*surface_, truth_, 20, 15, 1);
  const RegisteredPhoto found = expect_found();
  EXPECT_EQ(found.quality.verdict, Verdict::ok) << found.quality.reason;
}

// The clutter explains a little of many wrong poses; the organ's own pixels only of the right one.
TEST_F(RegisterRenderedLiver, WithoutAnyStart) { expect_found(); }

}  // namespace
}  // namespace organbake
