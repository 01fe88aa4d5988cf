// SPDX-License-Identifier: GPL-3.0-or-later

#include "cost_functions/cost_functions.h"
#include "depth/depth_alignment.h"
#include "lamp_studio.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "support/faulty_depth.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kWall_mm = 330;  // behind the studio's organ

// Half of the studio's organ, and the depth of all of it.
class Depth : public testing::Test {
 protected:
  const PosedCamera& camera_ = lamp_studio().cameras[0];
  const RigidTransform& truth_ = camera_.camera_from_world;
  const Vector3d up_ = truth_.rotation.row(1).transpose();
  const RegisteredSurface half_{cut_in_half(lamp_studio().surface.mesh(), up_, -20)};

  SeenDepth seen(const RegisteredSurface& organ, const DepthFaults& faults) const {
    return thin_depth(faulty_depth(organ.scene(), camera_, kWall_mm, faults, 1), {},
                      faults.mm_per_unit != 1);
  }
  SeenDepth seen(const DepthFaults& faults) const { return seen(lamp_studio().surface, faults); }
  DepthState true_state() const { return {object_pose(truth_, half_.center()), 0}; }
  double error_mm(const RigidTransform& found) const {
    return half_.mean_distance_mm(truth_, found);
  }
  PhotoToRegister photo(const DepthFaults& faults, std::uint64_t seed) const {
    PhotoToRegister photo =
        lamp_studio().photo(lamp_studio().textured, {.gain = 0.9, .offset = 0.01, .noise = 0.01});
    photo.depth = seen(faults);
    photo.start = disturbed(half_, truth_, 20, 15, seed);
    return photo;
  }
};

TEST_F(Depth, IsThinnedToPointsOfOneSurfaceEach) {
  std::vector<Vector3d> points;
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x) {
      const double z = x < 101 ? 50 : 80;  // a step within a cell
      points.push_back(z * Vector3d((x - 100) / 200.0, (y - 100) / 200.0, 1));
    }
  points.push_back({0, 0, -5});
  points.push_back(Vector3d::Constant(std::nan("")));
  const SeenDepth seen = thin_depth(points, {}, true);
  EXPECT_TRUE(seen.relative);
  EXPECT_GT(seen.points.size(), 1000U);
  for (const SeenDepth::Point& point : seen.points)
    EXPECT_TRUE(std::abs(point.place.z() - 50) < 1e-9 || std::abs(point.place.z() - 80) < 1e-9)
        << point.place.z();
  EXPECT_TRUE(thin_depth({}, {}, false).empty());
  EXPECT_TRUE(thin_depth({{0, 0, 5}}, {}, false).empty()) << "no view";
}

TEST_F(Depth, HasTheNormalsOfWhatIsSeen) {
  const Vector3d toward = Vector3d(0.4, -0.2, -1).normalized();
  std::vector<Vector3d> points;
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x) {
      const Vector3d ray((x - 100) / 200.0, (y - 100) / 200.0, 1);
      points.push_back(-60 / toward.dot(ray) * ray);
    }
  const SeenDepth seen = thin_depth(points, {}, false);
  ASSERT_GT(seen.points.size(), 1000U);
  std::size_t without = 0;  // at corners, where too few neighbours are
  for (const SeenDepth::Point& point : seen.points) {
    without += point.normal.isZero();
    if (point.normal.isZero()) continue;
    EXPECT_LT((point.normal - toward).norm(), 1e-2) << "a mean of places lies a little aside";
  }
  EXPECT_LT(without, seen.points.size() / 100);
}

// A wall behind the organ lies nearest to its flanks, which look elsewhere: by distance alone 55 %
// of what matched was the wall's, with normals 11 %.
TEST_F(Depth, OfWhatStandsBehindTheOrganMatchesLittle) {
  const SeenDepth depth = seen(DepthFaults{.noise = 0.01});
  const auto matches = match_depth(half_, depth, true_state());
  constexpr double kElsewhere = 0.03;  // of the distance: 9 mm
  int on = 0, elsewhere = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i].kind != DepthMatch::Kind::on) continue;
    ++on;
    elsewhere +=
        std::abs(depth_row(depth.points[i], matches[i], true_state(), half_.center()).distance) >
        kElsewhere;
  }
  EXPECT_GT(on, 100);
  EXPECT_LT(elsewhere, 0.15 * on);
}

TEST_F(Depth, CostHasItsOwnSlopes) {
  const SeenDepth depth = seen({.noise = 0.01});
  DepthState state = true_state();
  state.pose = moved(state.pose, Motion::Constant(0.02));
  const WeighedDepth weighed = weigh_depth(half_, depth, state);
  const ScalePrior prior{0.01, 0.02};
  const DepthCost cost(depth, weighed, prior, half_.center(), 0.5);
  const auto pose = state.pose.to_array();
  const double* parameters[] = {pose.data(), &state.log_scale};
  const auto half_squares = [&](const DepthState& at) {
    const auto numbers = at.pose.to_array();
    const double* values[] = {numbers.data(), &at.log_scale};
    Eigen::Matrix<double, 8, 1> r;
    cost.Evaluate(values, r.data(), nullptr);
    return 0.5 * r.squaredNorm();
  };
  Eigen::Matrix<double, 8, 1> r, by_scale;
  Eigen::Matrix<double, 8, 7, Eigen::RowMajor> by_pose;
  double* jacobians[] = {by_pose.data(), by_scale.data()};
  ASSERT_TRUE(cost.Evaluate(parameters, r.data(), jacobians));
  const Eigen::Matrix<double, 7, 1> gradient = by_pose.transpose() * r;
  const auto numbers = [&](const Motion& motion) -> Eigen::Matrix<double, 7, 1> {
    return Eigen::Matrix<double, 7, 1>::Map(moved(state.pose, motion).to_array().data());
  };
  constexpr double kStep = 1e-6;
  for (int j = 0; j < 7; ++j) {
    const auto at = [&](double step) {
      DepthState other = state;
      if (j < 6) other.pose = moved(state.pose, step * Motion::Unit(j));
      if (j == 6) other.log_scale += step;
      return half_squares(other);
    };
    const double expected = (at(kStep) - at(-kStep)) / (2 * kStep);
    const Motion step = j < 6 ? Motion(kStep * Motion::Unit(j)) : Motion(Motion::Zero());
    const double found =
        j < 6 ? gradient.dot(numbers(step) - numbers(-step)) / (2 * kStep) : by_scale.dot(r);
    EXPECT_NEAR(found, expected, 1e-4 * std::max(1.0, std::abs(expected))) << j;
  }
}

// A bias of the depth moves the pose along the view, which the photograph's own size of things
// holds; texture moves the photograph's, which depth holds. The same for any number of threads.
TEST_F(Depth, AndPhotographTogetherAreBetterThanEither) {
  const DepthFaults faults{.noise = 0.01, .bias = 0.02, .bumps_mm = 0.7, .hidden_share = 0.15};
  const PhotoToRegister both = photo(faults, 1);
  const RegisteredPhoto found = register_photo(half_, both, {});
  const double together_mm = error_mm(found.camera.camera_from_world);
  const FoundByDepth by_depth =
      search_by_depth(half_, both.depth, object_pose(*both.start, half_.center()), {});
  const double depth_mm = error_mm(rigid_transform(by_depth.state.pose, half_.center()));
  constexpr double kTogether_mm = 2.5;  // at 300 mm, of which a percent is 3, and 0.9 mm a pixel
  EXPECT_LT(together_mm, kTogether_mm);
  EXPECT_LT(together_mm, depth_mm);
  ASSERT_TRUE(found.quality.depth);
  EXPECT_NE(found.quality.verdict, Verdict::failed) << found.quality.reason;
  EXPECT_LT(together_mm, 3 * found.quality.surface_sd_mm) << "an RMS distance";
  EXPECT_GT(found.quality.depth->share, 0.6);
  const ThreadLimit one(1);
  const RegisteredPhoto again = register_photo(half_, both, {});
  EXPECT_EQ(found.camera.camera_from_world.rotation, again.camera.camera_from_world.rotation);
  EXPECT_EQ(found.camera.camera_from_world.translation, again.camera.camera_from_world.translation);
  EXPECT_EQ(found.quality.surface_sd_mm, again.quality.surface_sd_mm);
}

TEST_F(Depth, InAUnitOfItsOwnFindsItsScale) {
  const RegisteredPhoto found =
      register_photo(half_, photo({.noise = 0.01, .mm_per_unit = 2.5}, 2), {});
  EXPECT_LT(error_mm(found.camera.camera_from_world), 3);
  ASSERT_TRUE(found.quality.depth);
  EXPECT_NEAR(found.quality.depth->scale, 2.5, 0.05);
}

// Metric depth lies about as well on a surface of another size, somewhat nearer or farther.
TEST_F(Depth, TellsASurfaceOfAnotherSize) {
  PhotoToRegister right = photo({.noise = 0.01}, 6);
  right.start = disturbed(half_, truth_, 5, 3, 6);
  const auto fit_of = [&](double factor) {
    TriangleMesh mesh = half_.mesh();
    for (Vector3d& v : mesh.vertices) v = half_.center() + factor * (v - half_.center());
    return register_photo(RegisteredSurface(std::move(mesh)), right, {}).quality;
  };
  for (const double factor : {0.85, 1.0, 1.06}) {
    const PoseQuality quality = fit_of(factor);
    ASSERT_TRUE(quality.depth);
    EXPECT_NEAR(quality.depth->free_scale, factor, 0.02) << "of the depth's noise and a joint pose";
    EXPECT_LT(quality.depth->scale_sd, 0.02);
    EXPECT_TRUE(factor == 1 || quality.verdict != Verdict::ok) << factor;
  }
}

// A ball where the organ's piece should be.
TEST_F(Depth, OfAnotherOrganIsNotOk) {
  TriangleMesh ball = lamp_studio().surface.mesh();
  for (Vector3d& v : ball.vertices)
    v = lamp_studio().surface.center() + 55 * (v - lamp_studio().surface.center()).normalized();
  PhotoToRegister other = photo({}, 3);
  other.depth = seen(RegisteredSurface(ball), {.noise = 0.01});
  EXPECT_NE(register_photo(half_, other, {}).quality.verdict, Verdict::ok);
}

TEST_F(Depth, LeavesTheFocalLengthAsItIs) {
  RegistrationOptions options;
  options.free_focal = true;
  EXPECT_THROW(register_photo(half_, photo({}, 5), options), UsageError);
}

}  // namespace
}  // namespace organbake
