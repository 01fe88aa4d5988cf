// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(CaptureOptions, DefaultsAreValid) { EXPECT_NO_THROW(CaptureOptions().check()); }

TEST(CaptureOptions, EachBoundIsKept) {
  const auto refused = [](auto change) {
    CaptureOptions options;
    change(options);
    EXPECT_THROW(options.check(), UsageError);
  };
  refused([](auto& o) { o.rays_per_texel_side = -1; });
  refused([](auto& o) { o.rays_per_texel_side = 17; });
  refused([](auto& o) { o.base_step_mm = 0; });
  refused([](auto& o) { o.base_step_mm = 1001; });
  refused([](auto& o) { o.base_step_mm = kNaN; });
}

struct Inputs {
  TriangleMesh surface = painted(sphere_mesh(20, 2), {0.5f, 0.4f, 0.3f});
  TriangleMesh proxy = sphere_mesh(20, 1);
  std::vector<PosedCamera> cameras = {plain_camera({0, -90, 0}, Vector3d::Zero(), 32)};

  CaptureResult run() const {
    return capture(surface, proxy, cameras, *make_material_color({}), {});
  }
};

TEST(CaptureInputs, GoodOnesAreTaken) { EXPECT_EQ(Inputs().run().maps.size(), 1u); }

TEST(CaptureInputs, BrokenOnesAreRefused) {
  const auto refused = [](auto change) {
    Inputs inputs;
    change(inputs);
    EXPECT_THROW(inputs.run(), BadDataError);
  };
  refused([](auto& in) { in.surface = {}; });
  refused([](auto& in) { in.proxy = {}; });
  refused([](auto& in) { in.surface.vertices[3].x() = kNaN; });
  refused([](auto& in) { in.proxy.faces[0][1] = 999999; });
  refused([](auto& in) { in.cameras.clear(); });
  refused([](auto& in) { in.cameras[0].intrinsics.fx = 0; });
  refused([](auto& in) { in.cameras[0].camera_from_world.translation.y() = kNaN; });
  refused([](auto& in) { in.cameras[0].camera_from_world.rotation *= 2; });
  refused([](auto& in) { in.cameras[0].camera_from_world.rotation.row(0) *= -1; });
  refused([](Inputs& i) {  // another organ's, or of another coordinate system
    for (Vector3d& v : i.proxy.vertices) v.x() += 1e5;
  });
}

TEST(CaptureInputs, CanBeCancelled) {
  const Inputs inputs;
  const std::atomic<bool> cancel = true;
  EXPECT_THROW(capture(inputs.surface, inputs.proxy, inputs.cameras, *make_material_color({}), {},
                       RunContext({}, {}, &cancel)),
               CancelledError);
}

TEST(CaptureInputs, OneTexelCameraWorks) {
  Inputs inputs;
  inputs.cameras[0].intrinsics = {1, 1, 1, 1, 0.5, 0.5};
  const CaptureResult summary = inputs.run();
  EXPECT_NEAR(summary.maps[0].depth_mm[0], 70, 0.5);
}

template <class Value>
bool same_bytes(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
}

TEST(CaptureInputs, SameBytesForAnyNumberOfThreads) {
  const TriangleMesh surface = painted(lumpy_mesh(30, 4), {0.5f, 0.4f, 0.3f});
  const TriangleMesh proxy = lumpy_mesh(30, 1);
  const std::vector<PosedCamera> cameras = {odd_camera({0, -110, 10}, Vector3d::Zero()),
                                            plain_camera({90, 60, 0}, Vector3d::Zero(), 70)};
  const auto run = [&](std::size_t threads) {
    const ThreadLimit limit(threads);
    std::vector<Photo> photos = {photo_of(surface, plain_camera({100, 10, 50}, {0, 0, 0}, 90)),
                                 photo_of(surface, plain_camera({-9, -120, 5}, {0, 0, 0}, 80))};
    const auto color = make_photo_color(surface, std::move(photos));
    return capture(surface, proxy, cameras, *color, {});
  };
  const CaptureResult one = run(1), four = run(4);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    EXPECT_TRUE(same_bytes(one.maps[c].depth_mm, four.maps[c].depth_mm));
    EXPECT_TRUE(same_bytes(one.maps[c].color, four.maps[c].color));
    EXPECT_TRUE(same_bytes(one.maps[c].height_mm, four.maps[c].height_mm));
    EXPECT_TRUE(same_bytes(one.maps[c].face, four.maps[c].face));
    EXPECT_TRUE(same_bytes(one.maps[c].confidence, four.maps[c].confidence));
  }
  EXPECT_TRUE(same_bytes(one.base.height_mm, four.base.height_mm));
  EXPECT_TRUE(same_bytes(one.base.color, four.base.color));
  EXPECT_EQ(one.base.seen_by, four.base.seen_by);
  EXPECT_EQ(one.bound_in_prism, four.bound_in_prism);
  EXPECT_EQ(one.largest_height_mm, four.largest_height_mm);
}

}  // namespace
}  // namespace organbake
