// SPDX-License-Identifier: GPL-3.0-or-later
#ifdef ORGANBAKE_GRAPHICS
#include <algorithm>
#include <functional>
#include <memory>

#include "bench.h"
#include "measuring/frame_timing.h"
#include "measuring/player_bundles.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/graphics/offscreen_drawing.h"
#include "organbake/image/difference.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/player.h"

namespace organbake {
namespace {

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

}  // namespace
}  // namespace organbake
#endif
