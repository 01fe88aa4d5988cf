// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/player/player.h"
#include "organbake/truth/truth_tracker.h"
#include "suites/frame_timing.h"
#include "suites/player_parts.h"

namespace organbake {

void promise_truth(Bench& bench, PlayerBundles& bundles) {
  const FrameSize vga{640, 480, 10};
  const std::string task = vga.name() + ", one thread: picture";
  bench.now(task + " and its truth");
  Player player(bundles.folder({80, "fitted", bundles.map_size()}));
  player.load_all();
  const OneThread one_thread;
  Frame plain, kept;
  TruthTracker tracker(layers_from("depth,flow,mask"));
  Flow forward;
  const auto timings = bench.time(std::vector<std::function<void()>>{
      [&] {
        for (int i = 0; i < kFrames; ++i) player.draw(view_at(player.bundle(), vga, i), {}, plain);
      },
      [&] {
        DrawOptions options;
        options.keep_bound = true;
        for (int i = 0; i < kFrames; ++i) {
          const View view = view_at(player.bundle(), vga, i);
          player.draw(view, options, kept);
          tracker.advance(player, view, {}, kept);
          if (tracker.has_before()) tracker.find_forward(forward);
        }
      }});
  bench.add(Figure{task + " alone, CPU time a frame", "ms", ms_of(timings[0])});
  bench.add(Figure{task + ", depth, flow and mask, CPU time a frame", "ms", ms_of(timings[1]),
                   vga.target_ms});
}

}  // namespace organbake
