// SPDX-License-Identifier: GPL-3.0-or-later

#include "bench.h"
#include "measuring/agreement.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "support/testing.h"

namespace organbake {
namespace {

TEST(DepthAgreement, OneScaleIsTakenOutAndNoMore) {
  DepthPairs pairs;
  RandomStream random(1);
  for (int i = 0; i < 4000; ++i) {
    const double truth = random.uniform(30, 90), off = i % 2 ? 1.02 : 0.98;
    pairs.add(static_cast<float>(0.1 * truth * off), static_cast<float>(truth));
  }
  const DepthAgreement found = agreement_of(pairs);
  EXPECT_NEAR(found.scale, 10, 0.25);
  EXPECT_NEAR(found.mean_percent, 2, 0.15);
  EXPECT_GT(found.spearman, 0.99);
  EXPECT_EQ(found.covered_percent, 100);
}

TEST(DepthAgreement, WhatIsMissingLowersTheCoverageAlone) {
  DepthPairs pairs;
  for (int i = 1; i <= 100; ++i)
    pairs.add(i <= 80 ? static_cast<float>(i) : INFINITY, static_cast<float>(i));
  pairs.add(5, INFINITY);  // without a truth it is not asked for
  const DepthAgreement found = agreement_of(pairs);
  EXPECT_EQ(found.covered_percent, 80);
  EXPECT_EQ(found.mean_percent, 0);
  EXPECT_THROW(agreement_of(DepthPairs{}), std::invalid_argument);
}

TEST(DepthAgreement, RanksAreCompared) {
  EXPECT_DOUBLE_EQ(spearman({1, 2, 3, 4}, {1, 4, 9, 16}), 1);
  EXPECT_DOUBLE_EQ(spearman({1, 2, 3, 4}, {4, 3, 2, 1}), -1);
  // By hand: ranks 0.5 0.5 2 3 and 0 1 2 3 give 4.5 / √(4.5 · 5).
  EXPECT_NEAR(spearman({1, 1, 2, 3}, {1, 2, 3, 4}), 4.5 / std::sqrt(22.5), 1e-12);
  EXPECT_EQ(spearman({1, 1}, {1, 2}), 0);
}

// A plane's map at half the size agrees with the whole one to the last digit.
TEST(DepthAgreement, MapsOfOtherSizesMeetAtPixelCentres) {
  Plane whole(40, 20), half(20, 10);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 40; ++x) whole.at(x, y) = 50 + 0.5f * (x + 0.5f) + 0.25f * (y + 0.5f);
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 20; ++x) half.at(x, y) = 50 + 1.0f * (x + 0.5f) + 0.5f * (y + 0.5f);
  whole.at(0, 0) = INFINITY;
  DepthPairs pairs;
  pairs.add_maps(half, whole);
  EXPECT_EQ(pairs.asked, 199u);
  EXPECT_LT(agreement_of(pairs).mean_percent, 1e-4);
}

TEST(DepthAgreement, PointsBehindNearerOnesAreHidden) {
  PosedCamera camera;
  camera.intrinsics = {100, 80, 50, 50, 50, 40};
  const std::vector<Eigen::Vector3d> cloud = {
      {0, 0, 10}, {0.1, 0.1, 12}, {0, 0, -5}, {5, 0, 10}, {50, 0, 10}};
  const auto seen = nearest_points(camera, cloud, 8);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].depth, 10);
  EXPECT_EQ(seen[0].pixel, Eigen::Vector2d(50, 40));
  EXPECT_EQ(seen[1].pixel, Eigen::Vector2d(75, 40));
}

using Eigen::Vector3d;

CameraSet helix(int frames) {
  CameraSet set;
  for (int i = 0; i < frames; ++i) {
    PosedCamera camera;
    camera.name = "frame_" + std::to_string(100000 + i).substr(1);
    camera.intrinsics = {640, 480, 500, 500, 320, 240};
    camera.camera_from_world = look_at({20 * std::cos(0.1 * i), 20 * std::sin(0.1 * i), 0.5 * i},
                                       {0, 0, 60}, Vector3d::UnitY());
    set.cameras.push_back(camera);
  }
  return set;
}

// The same cameras in another world: x_other = scale · turn · x + shift.
CameraSet moved(const CameraSet& set, double scale, const Eigen::Matrix3d& turn,
                const Vector3d& shift) {
  CameraSet result = set;
  for (PosedCamera& camera : result.cameras) {
    const Vector3d center = scale * (turn * camera.center_world_mm()) + shift;
    camera.camera_from_world.rotation = camera.camera_from_world.rotation * turn.transpose();
    camera.camera_from_world.translation = -(camera.camera_from_world.rotation * center);
  }
  return result;
}

const Eigen::Matrix3d kTurn =
    Eigen::AngleAxisd(1.1, Vector3d(1, 2, 3).normalized()).toRotationMatrix();

TEST(PathAlignment, TheSamePathInAnotherWorldHasNoError) {
  const CameraSet truth = helix(30);
  const auto error = path_error(moved(truth, 0.1, kTurn, {1, 2, 3}), truth);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->frames, 30u);
  EXPECT_LT(error->rms_percent, 1e-9);
  EXPECT_NEAR(error->scale, 10, 1e-9);
}

// Every other centre is off by 1 % of the extent to one side and the rest to the other: the
// alignment cannot take that up.
TEST(PathAlignment, TheErrorIsAShareOfTheExtent) {
  const CameraSet truth = helix(40);
  double extent = 0;
  for (const PosedCamera& a : truth.cameras)
    for (const PosedCamera& b : truth.cameras)
      extent = std::max(extent, (a.center_world_mm() - b.center_world_mm()).norm());
  CameraSet found = truth;
  for (std::size_t i = 0; i < found.cameras.size(); ++i) {
    RigidTransform& pose = found.cameras[i].camera_from_world;
    const Vector3d off(0, 0, (i % 2 ? 0.01 : -0.01) * extent);
    pose.translation -= pose.rotation * off;
  }
  EXPECT_NEAR(path_error(found, truth)->rms_percent, 1, 0.02);
}

TEST(PathAlignment, FramesAreMatchedByTheirNumbers) {
  EXPECT_EQ(frame_of_name("frame_000012.png"), 12);
  EXPECT_EQ(frame_of_name("frame_0005"), 5);
  EXPECT_EQ(frame_of_name("000120.exr"), 120);
  EXPECT_FALSE(frame_of_name("left"));
  EXPECT_FALSE(frame_of_name(""));
  const CameraSet truth = helix(30);
  CameraSet part = truth;
  part.cameras.erase(part.cameras.begin(), part.cameras.begin() + 20);
  part.cameras[0].name = "frame_00777.png";
  EXPECT_EQ(path_error(part, truth)->frames, 9u);
  part.cameras.resize(3);
  EXPECT_FALSE(path_error(part, truth));
}

TEST(SuiteText, TellsPointsFiguresAndWhatIsMissing) {
  const Timing timing{3, {1.5, 1, 2}, {1, 1, 1}, 7};
  SuiteResult result;
  result.points = {{"task", "we", false, {{"cameras", "", 11}}, timing, {{"gap", "%", 0.25}}},
                   {"task", "they", true, {}, {}, {{"gap", "%", 0.5}}}};
  result.figures = {{"small", "mm", 1, 2}, {"large", "mm", 3, 2}};
  result.skipped = {{"a clip", "no --data"}};
  result.failure = "stopped";
  EXPECT_EQ(suite_text({"suite", "summary", 1.5, result}),
            "suite: summary (1.5 s)\n"
            "  task: we, cameras 11: 1.5 ms, CPU 1 ms, 7 MB; gap 0.25 %\n"
            "  task: they (peer): gap 0.5 %\n"
            "  reached: small: 1 mm ≤ 2\n"
            "  MISSED:  large: 3 mm ≤ 2\n"
            "  left out: a clip: no --data\n"
            "  ended early: stopped\n");
}

SuiteResult run(void (*suite)(Bench&), const BenchOptions& options = {}) {
  return run_suite({"suite", "summary", {suite}}, options, {});
}

TEST(RunSuite, LeavesNoFolderBehind) {
  const SuiteResult result = run([](Bench& bench) {
    write_file_atomically(bench.scratch() / "file", "text");
    bench.skip(bench.scratch(), "the test wants to know");
    throw std::runtime_error("no more");
  });
  ASSERT_EQ(result.skipped.size(), 1u);
  EXPECT_TRUE(std::filesystem::path(result.skipped[0].what).is_absolute());
  EXPECT_FALSE(std::filesystem::exists(result.skipped[0].what));
}

TEST(TimeInTurn, EndsAtItsBudgetButNotBeforeTheLeastRounds) {
  int calls = 0;
  const auto work = [&] { ++calls; };
  const auto timings = time_in_turn({work}, {.most = 9, .least = 3, .budget_s = 0});
  EXPECT_EQ(timings[0].runs, 3);
  EXPECT_EQ(calls, 4);  // and the first, which is not counted
  EXPECT_EQ(time_in_turn({work}, {.most = 5, .least = 3, .budget_s = 1e6})[0].runs, 5);
}

TEST(RunSuite, CountsRoundsAndMemory) {
  const SuiteResult result = run(
      [](Bench& bench) {
        const auto touch = [](std::size_t mb) {
          const std::vector<char> memory(mb << 20, 1);
          ASSERT_EQ(memory.back(), 1);
        };
        const auto timings =
            bench.time(std::vector<std::function<void()>>{[&] { touch(64); }, [&] { touch(8); }});
        for (const Timing& t : timings) bench.add(Point{"task", "who", false, {}, t, {}});
      },
      {.rounds = 5, .data = {}});
  ASSERT_EQ(result.points.size(), 2u);
  EXPECT_EQ(result.points[0].timing.runs, 5);
  EXPECT_NEAR(result.points[0].timing.peak_mb, 64, 4);
  EXPECT_LE(result.points[0].timing.wall_ms.least, result.points[0].timing.wall_ms.median);
}

TEST(Bench, SaysWhatRealDataIsMissing) {
  const SuiteResult result = run(
      [](Bench& bench) { EXPECT_TRUE(bench.data("mesh/none.vtk").empty()); }, {.data = "/nowhere"});
  ASSERT_EQ(result.skipped.size(), 1u);
  EXPECT_EQ(result.skipped[0].what, "mesh/none.vtk");
}

}  // namespace
}  // namespace organbake
