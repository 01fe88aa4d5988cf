// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <thread>

#include "bench.h"
#include "measuring/programs.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/image/difference.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/player.h"
#include "peers/peers.h"
#ifdef ORGANBAKE_GRAPHICS
#include "organbake/graphics/offscreen_drawing.h"
#endif

namespace organbake {
namespace {

using ViewAt = View (*)(const Bundle& bundle, const FrameSize& size, int frame);

std::function<void()> frames(Player& player, ViewAt view, const FrameSize& size, Frame& frame) {
  return [&player, view, &size, &frame] {
    for (int i = 0; i < kFrames; ++i) player.draw(view(player.bundle(), size, i), {}, frame);
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
    const auto weights = player.draw(view(player.bundle(), size, i), {}, frame).weights.weights;
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
  EmbreeFrames embree(surface);
  Rgb8Image traced;
  const ThreadLimit one_thread(1);
  const Timing embree_timing = bench.time([&] {
    for (int i = 0; i < kFrames; ++i)
      embree.draw(surface.vertices, view_at(frame_of_truth, size, i), traced);
  });
  embree.draw(surface.vertices, first_view, traced);
  bench.peer(task, "Embree refit + trace, the truth's mesh", of_one(embree_timing, kFrames),
             {{error, "levels", rms_levels(traced, truth)}},
             {{"faces", "", double(surface.faces.size())}});
  for (const int map_size : map_sizes(bench)) {
    Player player(bundles.folder({80, "fitted", map_size}));
    player.load_all();
    bench.now(task + ", maps of " + std::to_string(map_size) + "²");
    Frame frame;
    const Timing timing = bench.time(orbit(player, size, frame));
    DrawOptions black;
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

// Who draws a mesh as engines hold it, and how much less time we are to take with maps of 512² and
// of 1024²; 0: is told.
struct Rival {
  std::string name;
  std::array<double, 2> target;
  std::function<void(const View&)> draw;
};

// Its time of a frame over ours.
void race(Bench& bench, PlayerBundles& bundles, const FrameSize& size, const Rival& rival) {
  const ThreadLimit one_thread(1);
  bench.now(size.name() + ", one thread, beside " + rival.name);
  for (const int map_size : map_sizes(bench)) {
    Player player(bundles.folder({80, "fitted", map_size}));
    player.load_all();
    Frame frame;
    const auto timings = bench.time(
        std::vector<std::function<void()>>{orbit(player, size, frame), [&] {
                                             for (int i = 0; i < kFrames; ++i)
                                               rival.draw(view_at(player.bundle(), size, i));
                                           }});
    bench.at_least(size.name() + ", one thread, CPU time of a frame, maps of " +
                       std::to_string(map_size) + "²: " + rival.name + " / organplay",
                   "×", ms_of(timings[1]) / ms_of(timings[0]),
                   rival.target[map_size > 512 ? 1 : 0]);
  }
}

void race_embree(Bench& bench, PlayerBundles& bundles, const FrameSize& size) {
  const TriangleMesh& mesh = bundles.skinned_mesh(6).mesh;
  EmbreeFrames embree(mesh);
  Rgb8Image traced;
  race(bench, bundles, size, {"Embree refit + trace", {5, 5}, [&](const View& view) {
                                embree.draw(mesh.vertices, view, traced);
                              }});
}

#ifdef ORGANBAKE_HAS_EGL
void race_llvmpipe(Bench& bench, PlayerBundles& bundles, const FrameSize& size) {
  struct Way {
    std::string name;
    int subdivisions, samples;
    std::array<double, 2> target;
  };
  const std::vector<Way> ways = {{"81,920 faces", 6, 1, {5, 2.5}},
                                 {"81,920 faces, 4 samples a pixel", 6, 4, {0, 0}},
                                 {"1,310,720 faces", 8, 1, {0, 0}}};
  for (const Way& way : ways) {
    if (bench.quick() && way.target[0] == 0) continue;
    const SkinnedMesh& skinned = bundles.skinned_mesh(way.subdivisions);
    SoftwareGl gl(skinned, size.width, size.height, way.samples);
    race(bench, bundles, size,
         {gl.renderer() + ", textured, uploaded each frame, " + way.name, way.target,
          [&](const View& view) { gl.draw(skinned.mesh.vertices, view); }});
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

void promise_frames(Bench& bench) {
  PlayerBundles bundles(bench.scratch(), bench.context(), bench.quick());
  const FrameSize hd{1280, 720, 7.5}, full_hd{1920, 1080, 14.5};
  compete(bench, bundles, hd);
  if (!bench.quick()) compete(bench, bundles, full_hd);
  race_embree(bench, bundles, hd);
#ifdef ORGANBAKE_HAS_EGL
  race_llvmpipe(bench, bundles, hd);
#else
  bench.skip("Mesa's llvmpipe", "built without libegl-dev");
#endif
  promise_threads(bench, bundles, hd);
}

const RegisteredPart kPlayerFrames("player", promise_frames);

#ifdef ORGANBAKE_GRAPHICS
struct GraphicsPlayers {
  Player by_processor, by_graphics;
  std::shared_ptr<OffscreenDrawing> graphics = std::make_shared<OffscreenDrawing>();

  explicit GraphicsPlayers(const std::filesystem::path& bundle)
      : by_processor(bundle), by_graphics(bundle) {
    by_graphics.draw_by(graphics);
  }
};

// Frames of an orbit, read back into memory as everybody's are.
void promise_graphics_size(Bench& bench, GraphicsPlayers& players, const FrameSize& size) {
  const std::string task = size.name() + ", drawn by " + players.graphics->device().name;
  bench.now(task);
  const auto draw = [&size](Player& player, Frame& frame, int i) {
    player.draw(view_at(player.bundle(), size, i), {}, frame);
  };
  Frame by_processor, by_graphics;
  double least_db = 100;
  for (int i = 0; i < kFrames; ++i) {
    draw(players.by_processor, by_processor, i);
    draw(players.by_graphics, by_graphics, i);
    least_db = std::min(least_db, compare_images(by_processor.color, by_graphics.color).psnr_db);
  }
  const auto timings = bench.time(std::vector<std::function<void()>>{[&] {
    for (int i = 0; i < kFrames; ++i) draw(players.by_graphics, by_graphics, i);
  }});
  bench.at_least(task + ": least agreement with the processor", "dB", least_db,
                 GraphicsDrawing::kLeastAgreement_db);
  bench.at_most(task + ": a frame, read back", "ms", timings[0].wall_ms.median / kFrames,
                size.target_ms);
}

// Both against 16 rays a pixel, over the orbit: how much more wrong graphics hardware's pictures
// are.
void promise_graphics_truth(Bench& bench, GraphicsPlayers& players,
                            const std::filesystem::path& bundle) {
  const FrameSize size{640, 360};
  const std::string task =
      size.name() + " against 16 rays a pixel, by " + players.graphics->device().name;
  bench.now(task);
  const TriangleMesh surface = BundleReader(bundle).read_surface();
  const CarriedSurface carried(surface, players.by_processor.bundle().shell());
  double most_db = -100;
  Frame by_processor, by_graphics;
  for (int i = 0; i < kFrames; ++i) {
    const View view = view_at(players.by_processor.bundle(), size, i);
    const TruthFrame truth = carried.draw(surface.vertices, view, DrawOptions().background);
    const auto draw = [&](Player& player, Frame& frame) {
      player.draw(view, {}, frame);
      return compare_images(frame.color, truth.color, truth.covered).psnr_db;
    };
    most_db = std::max(
        most_db, draw(players.by_processor, by_processor) - draw(players.by_graphics, by_graphics));
  }
  bench.at_most(task + ": below the processor's, most", "dB", most_db, 0.5);
}

// All cameras' samples in the hardware's memory, and what they are drawn with.
void promise_graphics_memory(Bench& bench, GraphicsPlayers& players, int map_size) {
  const std::size_t cameras = players.by_graphics.bundle().cameras.cameras.size();
  Frame frame;
  for (const auto& camera : players.by_graphics.bundle().cameras.cameras) {
    View view;
    view.camera = camera;
    view.camera.intrinsics = scaled_lens(camera.intrinsics, 64, 64);
    players.by_graphics.draw(view, {}, frame);
  }
  constexpr double kMb = 1e6, kMostMb_per_texel = 160.0 / (8 * 1024 * 1024);
  bench.at_most("tables of " + std::to_string(cameras) + " cameras of " + std::to_string(map_size) +
                    "² in graphics hardware's memory",
                "MB", double(players.graphics->table_bytes()) / kMb,
                kMostMb_per_texel * double(cameras) * map_size * map_size);
}

void promise_graphics(Bench& bench) {
  try {
    PlayerBundles bundles(bench.scratch(), bench.context(), bench.quick());
    const auto bundle = bundles.folder({80, "fitted", bundles.map_size()});
    GraphicsPlayers players(bundle);
    promise_graphics_truth(bench, players, bundle);
    promise_graphics_memory(bench, players, bundles.map_size());
    if (players.graphics->device().software)
      return promise_graphics_size(bench, players, {640, 360, 0});
    for (const FrameSize& size : {FrameSize{1280, 720, 4}, {1920, 1080, 6}, {3840, 2160, 14}})
      promise_graphics_size(bench, players, size);
  } catch (const UsageError& error) {
    bench.skip("frames by graphics hardware", error.what());
  }
}

const RegisteredPart kPlayerGraphics("player", promise_graphics);
#endif

}  // namespace
}  // namespace organbake
