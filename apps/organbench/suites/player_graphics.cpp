// SPDX-License-Identifier: GPL-3.0-or-later
#ifdef ORGANBAKE_GRAPHICS
#include <functional>
#include <memory>

#include "bench.h"
#include "measuring/frame_timing.h"
#include "measuring/player_bundles.h"
#include "organbake/core/error.h"
#include "organbake/graphics/offscreen_drawing.h"
#include "organbake/image/difference.h"
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

void promise_graphics(Bench& bench) {
  try {
    PlayerBundles bundles(bench.scratch(), bench.context(), bench.quick());
    GraphicsPlayers players(bundles.folder({80, "fitted", bundles.map_size()}));
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
