// SPDX-License-Identifier: Apache-2.0
// A warper that reads its cameras as views need them.
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>

#include "organbake/core/error.h"
#include "organbake/warp/warper.h"
#include "support/synthetic_bundle.h"
#include "views_round.h"

namespace organbake {
namespace {

const Bundle& late_organ() {
  static const Bundle bundle = make_synthetic_bundle({});
  return bundle;
}

// Hands out the organ's maps and remembers which were asked for.
struct Source {
  std::mutex mutex;
  std::multiset<std::size_t> asked;
  std::atomic<bool> broken{false};

  Warper::ReadMaps reader() {
    return [this](std::size_t camera) {
      const std::scoped_lock lock(mutex);
      asked.insert(camera);
      if (broken) throw BadDataError("cam: damaged");
      return late_organ().maps[camera];
    };
  }
};

Bundle without_maps() {
  Bundle frame = late_organ();
  for (CameraMaps& maps : frame.maps) maps = {};
  return frame;
}

TEST(LateCameras, AreReadWhenAViewNeedsThemAndOnce) {
  Source source;
  Warper late(without_maps(), source.reader()), early(late_organ());
  EXPECT_TRUE(source.asked.empty());
  Frame a, b;
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0.4, -1, 0.3), {0.4, -1, 0.3}, {-1, 0.5, 0}}) {
    const View view = view_from(late_organ(), eye, 96);
    const DrawReport report = late.draw(late_organ().proxy.vertices, view, {}, a);
    early.draw(late_organ().proxy.vertices, view, {}, b);
    EXPECT_EQ(a.color.pixels, b.color.pixels);
    for (int i = 0; i < 3; ++i) {
      if (report.weights.weights[i] <= 0) continue;
      EXPECT_EQ(source.asked.count(report.weights.cameras[i]), 1u);
    }
  }
  EXPECT_LT(source.asked.size(), late_organ().maps.size());
}

TEST(LateCameras, AreAllReadOnceWhenReadAhead) {
  Source source;
  Warper warper(without_maps(), source.reader());
  warper.bind_ahead();
  warper.bind_ahead();
  warper.bind_all();  // beside the thread
  EXPECT_EQ(source.asked.size(), late_organ().maps.size());
  EXPECT_EQ(std::set(source.asked.begin(), source.asked.end()).size(), late_organ().maps.size());
}

TEST(LateCameras, ADamagedOneIsSaidByTheViewThatNeedsItAndTriedAgain) {
  Source source;
  source.broken = true;
  Warper warper(without_maps(), source.reader());
  warper.bind_ahead();  // fails quietly
  const View view = view_from(late_organ(), {0.4, -1, 0.3}, 96);
  Frame frame;
  EXPECT_THROW(warper.draw(late_organ().proxy.vertices, view, {}, frame), BadDataError);
  source.broken = false;
  EXPECT_GT(warper.draw(late_organ().proxy.vertices, view, {}, frame).sample_pixels, 0u);
}

}  // namespace
}  // namespace organbake
