// SPDX-License-Identifier: GPL-3.0-or-later
// The player's frames along an orbit, one thread: time against error, beside a mesh that Embree
// traces or llvmpipe draws; what two threads gain; and what light at the scope costs.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <thread>

#include "bench.h"
#include "measuring/programs.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/capture/surface_color.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/image/difference.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/player.h"
#include "organbake/warp/warper.h"
#include "peers/peers.h"

namespace organbake {
namespace {

using ViewAt = View (*)(const Bundle& bundle, const FrameSize& size, int frame);

std::function<void()> frames(Player& player, ViewAt view, const FrameSize& size, Frame& frame) {
  return [&player, view, &size, &frame] {
    for (int i = 0; i < kFrames; ++i)
      player.draw(view(player.bundle(), size, i), {.light = DrawnLight::baked}, frame);
  };
}

std::function<void()> orbit(Player& player, const FrameSize& size, Frame& frame) {
  return frames(player, view_at, size, frame);
}

double percent_covered(const Frame& frame) {
  const auto open = std::count(frame.cover.begin(), frame.cover.end(), Cover::background);
  return 100 - 100.0 * double(open) / double(frame.cover.size());
}

// Of the frames that are timed, means.
struct FrameContent {
  double cameras = 0, percent_covered = 0;
};

FrameContent content_of(Player& player, ViewAt view, const FrameSize& size) {
  Frame frame;
  FrameContent mean;
  for (int i = 0; i < kFrames; ++i) {
    const auto weights =
        player.draw(view(player.bundle(), size, i), {.light = DrawnLight::baked}, frame)
            .weights.weights;
    const auto drawn =
        std::count_if(weights.begin(), weights.end(), [](double w) { return w > 0; });
    mean.cameras += double(drawn) / kFrames;
    mean.percent_covered += percent_covered(frame) / kFrames;
  }
  return mean;
}

double rms_levels(const Rgb8Image& picture, const TruthFrame& truth) {
  return 255 * std::pow(10.0, -compare_images(picture, truth.color, truth.covered).psnr_db / 20);
}

// The sizes of maps that a frame's time is measured with.
std::vector<int> map_sizes(const Bench& bench) {
  return bench.quick() ? std::vector{256} : std::vector{512, 1024};
}

void promise_frame_time(Bench& bench, Player& player, ViewAt view, const FrameSize& size,
                        const std::string& task, const Timing& timing) {
  const FrameContent content = content_of(player, view, size);
  bench.at_most(task + ", in " + to_text(content.percent_covered, 1) +
                    " % of the picture, maps of 1024², " + to_text(content.cameras, 1) +
                    " of the three cameras drawn: CPU time a frame",
                "ms", ms_of(timing), size.target_ms);
}

// Run time against error: our maps' size, beside the truth's own mesh traced with one ray a pixel.
void compete(Bench& bench, PlayerBundles& bundles, const FrameSize& size) {
  const std::string task = size.name() + ", one thread, organ at rest";
  const std::string error = "image error against 16 rays a pixel, RMS";
  const BundleReader reader(bundles.folder({80, "fitted", bundles.map_size()}));
  const TriangleMesh surface = reader.read_surface();
  const Bundle frame_of_truth = reader.read_frame();  // the cameras are the same for all map sizes
  const View first_view = view_at(frame_of_truth, size, 0);
  const TruthFrame truth =
      CarriedSurface(surface, frame_of_truth.shell()).draw(surface.vertices, first_view, {0, 0, 0});
  EmbreeTracer embree(surface);
  Rgb8Image traced;
  const ThreadLimit one_thread(1);
  const Timing embree_timing = bench.time([&] {
    for (int i = 0; i < kFrames; ++i)
      embree.draw(surface.vertices, view_at(frame_of_truth, size, i), traced);
  });
  embree.draw(surface.vertices, first_view, traced);
  bench.add({task,
             "Embree refit + trace, the truth's mesh",
             true,
             {{"faces", "", double(surface.faces.size())}},
             of_one(embree_timing, kFrames),
             {{error, "levels", rms_levels(traced, truth)}}});
  for (const int map_size : map_sizes(bench)) {
    Player player(bundles.folder({80, "fitted", map_size}));
    player.load_all();
    bench.now(task + ", maps of " + std::to_string(map_size) + "²");
    Frame frame;
    const Timing timing = bench.time(orbit(player, size, frame));
    DrawOptions black;
    black.light = DrawnLight::baked;
    black.background = {0, 0, 0};
    player.draw(view_at(player.bundle(), size, 0), black, frame);
    bench.point(task, "organplay", of_one(timing, kFrames),
                {{error, "levels", rms_levels(frame.color, truth)}},
                {{"maps", "px", double(map_size)}});
    if (map_size != 1024) continue;
    promise_frame_time(bench, player, view_at, size, task, timing);
    // From between three cameras, which costs most.
    const Timing of_three = bench.time(frames(player, view_between_three, size, frame));
    promise_frame_time(bench, player, view_between_three, size, task, of_three);
  }
}

#ifdef ORGANBAKE_HAS_EGL
// A mesh as engines hold it, textured and uploaded each frame: its time of a frame over ours.
void race_llvmpipe(Bench& bench, PlayerBundles& bundles, const FrameSize& size) {
  const SkinnedMesh& skinned = bundles.skinned_mesh(6);
  SoftwareGl gl(skinned, size.width, size.height);
  const ThreadLimit one_thread(1);
  bench.now(size.name() + ", one thread, beside " + gl.renderer());
  for (const int map_size : map_sizes(bench)) {
    Player player(bundles.folder({80, "fitted", map_size}));
    player.load_all();
    Frame frame;
    const auto timings = bench.time(std::vector<std::function<void()>>{
        orbit(player, size, frame), [&] {
          for (int i = 0; i < kFrames; ++i)
            gl.draw(skinned.mesh.vertices, view_at(player.bundle(), size, i));
        }});
    bench.at_least(size.name() + ", one thread, CPU time of a frame, maps of " +
                       std::to_string(map_size) + "²: " + gl.renderer() + ", " +
                       std::to_string(skinned.mesh.faces.size()) + " faces / organplay",
                   "×", ms_of(timings[1]) / ms_of(timings[0]), map_size > 512 ? 2 : 2.5);
  }
}
#endif

// Work that shares nothing and fits the caches.
void be_busy() {
  volatile double sink = 0;
  double x = 1;
  for (int i = 0; i < 20'000'000; ++i) x = x * 1.0000001 + 1e-9;
  sink = x;
  (void)sink;
}

// What two threads gain, beside what this machine lets two loops gain that share nothing.
void promise_threads(Bench& bench, PlayerBundles& bundles, const FrameSize& size) {
  if (std::thread::hardware_concurrency() < 2)
    return bench.skip("two threads", "the machine has one core");
  bench.now("two threads");
  Player player(bundles.folder({80, "fitted", bundles.map_size()}));
  player.load_all();
  Frame frame;
  const auto draw = orbit(player, size, frame);
  const auto with_threads = [&](std::size_t threads) {
    return [&draw, threads] {
      const ThreadLimit limit(threads);
      draw();
    };
  };
  const auto timings = bench.time(std::vector<std::function<void()>>{
      with_threads(1), with_threads(2), [] { be_busy(), be_busy(); },
      [] {
        std::thread other(be_busy);
        be_busy();
        other.join();
      }});
  const auto gain = [&](int alone) {
    return timings[alone].wall_ms.median / timings[alone + 1].wall_ms.median;
  };
  bench.at_least(size.name() + ", two threads: speed-up / that of two independent loops", "×",
                 gain(0) / gain(2), 0.8);
}

// What light costs where all skin moves: kept as it was baked, and from the scope on a wet liver.
void promise_light(Bench& bench, PlayerBundles& bundles, const FrameSize& size) {
  constexpr int kStill = 1000;  // times as many when nothing changes: one is too short to time
  bench.now("skin lit anew");
  const ThreadLimit one_thread(1);
  Bundle bundle = BundleReader(bundles.folder({80, "fitted", bundles.map_size()})).read_all();
  Material liver;
  liver.tissue = Tissue::liver;
  const Lighting wet = liver.lighting();
  bundle.lighting->scope = wet.scope, bundle.lighting->finish = wet.finish;
  bundle.lighting->gloss = wet.gloss;
  Warper warper(bundle);
  const View view = view_at(bundle, size, 0);
  std::array<std::vector<Eigen::Vector3d>, 2> poses = {bundle.proxy.vertices,
                                                       bundle.proxy.vertices};
  for (Eigen::Vector3d& v : poses[1]) v *= 0.99;
  Frame frame;
  const auto moving = [&](DrawnLight light) {
    return [&, light] {
      DrawOptions options;
      options.light = light;
      for (int i = 0; i < kFrames; ++i) warper.draw(poses[i % 2], view, options, frame);
    };
  };
  const auto timings = bench.time(
      std::vector<std::function<void()>>{moving(DrawnLight::baked), moving(DrawnLight::scope), [&] {
                                           for (int i = 0; i < kStill * kFrames; ++i)
                                             warper.draw(poses[1], view, {}, frame);
                                         }});
  const std::string task = size.name() + ", one thread, all skin moves";
  bench.point(task, "organplay, the light that was baked", of_one(timings[0], kFrames));
  bench.point(task, "organplay, lit by the scope, wet", of_one(timings[1], kFrames));
  bench.at_most(task + ": lit by the scope / the light that was baked", "×",
                ms_of(timings[1]) / ms_of(timings[0]), 1.4);
  bench.at_most(size.name() + ": an unchanged frame, CPU time", "ms", ms_of(timings[2]) / kStill,
                0.05);
}

void promise_frames(Bench& bench) {
  PlayerBundles bundles(bench.scratch(), bench.context(), bench.quick());
  const FrameSize hd{1280, 720, 7.5}, full_hd{1920, 1080, 14.5};
  compete(bench, bundles, hd);
  if (!bench.quick()) compete(bench, bundles, full_hd);
#ifdef ORGANBAKE_HAS_EGL
  race_llvmpipe(bench, bundles, hd);
#else
  bench.skip("Mesa's llvmpipe", "built without libegl-dev");
#endif
  promise_threads(bench, bundles, hd);
  promise_light(bench, bundles, hd);
}

const RegisteredPart kPlayerFrames("player", promise_frames);

}  // namespace
}  // namespace organbake
