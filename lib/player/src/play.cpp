// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/play.h"

#include "organbake/core/error.h"
#include "organbake/core/stopwatch.h"
#include "organbake/player/instrument_motion.h"
#include "organbake/player/script_camera.h"

namespace organbake {
void PlayOptions::check() const {
  if (width < 1 || height < 1 || width > kLargestSide_px || height > kLargestSide_px) {
    throw UsageError("a size of " + std::to_string(width) + "x" + std::to_string(height) +
                     " pixels cannot be drawn; each side needs 1…16384");
  }
}

std::vector<PlayedFrame> play(Player& player, const Script& script, const PlayOptions& options,
                              const std::function<void(int, const Frame&)>& show,
                              const RunContext& context) {
  options.check();
  const int width = script.width > 0 ? script.width : options.width;
  const int height = script.height > 0 ? script.height : options.height;
  const InstrumentMotion motion(script, player.bundle());
  player.reset();
  std::vector<PlayedFrame> played;
  Frame picture;
  for (int frame = 0; frame < script.frames; ++frame) {
    context.throw_if_cancelled();
    std::vector<Instrument> instruments = motion.at(frame * script.time_step_s);
    View view = view_at(script, frame, player.bundle().cameras, width, height);
    if (options.lens) view.camera.intrinsics = *options.lens;
    PlayedFrame& entry = played.emplace_back();
    Stopwatch watch;
    entry.step = player.step(instruments);
    entry.deform_ms = watch.lap();
    for (std::size_t i = 0; i < instruments.size(); ++i) {
      instruments[i].position_mm = entry.step.tip_position_mm[i];  // tools hold each other off
    }
    DrawOptions draw = options.draw;
    if (options.instruments) draw.solids = motion.solids(instruments);
    watch.lap();
    entry.draw = player.draw(view, draw, picture);
    entry.draw_ms = watch.lap();
    if (entry.step.recovered) {
      context.warn("frame " + std::to_string(frame) +
                   ": the tissue's state was lost and reset to rest");
    }
    if (entry.step.tip_too_fast) {
      context.warn("frame " + std::to_string(frame) +
                   ": an instrument moved so far in one step that it may have passed through "
                   "skin; take a shorter time step or a larger tip");
    }
    context.throw_if_cancelled();  // a large frame takes its time, too
    if (show) show(frame, picture);
    if (options.watch)
      options.watch(
          {frame, frame * script.time_step_s, view, instruments, draw.solids, entry.step, picture});
    context.progress(double(frame + 1) / script.frames);
  }
  return played;
}

}  // namespace organbake
