// SPDX-License-Identifier: Apache-2.0
// Plays a script frame by frame: tools and camera of the moment, a step, a picture; and writes the
// report of times, contacts and forces.
#include "organbake/player/script.h"

#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/quantile.h"
#include "organbake/core/stopwatch.h"
#include "organbake/core/text.h"
#include "organbake/player/held_tools.h"

namespace organbake {
namespace {

Json frame_json(const PlayedFrame& f) {
  Json forces = Json::array();
  for (const auto& force : f.step.tip_force_n) forces.push_back(to_json(force));
  Json places = Json::array();
  for (const auto& place : f.step.tip_position_mm) places.push_back(to_json(place));
  return {{"deform_ms", f.deform_ms},
          {"draw_ms", f.draw_ms},
          {"phases_ms",
           {{"transform", f.draw.times.transform},
            {"splat", f.draw.times.splat},
            {"base", f.draw.times.base},
            {"resolve", f.draw.times.resolve},
            {"fill", f.draw.times.fill},
            {"tools", f.draw.times.tools}}},
          {"unchanged", f.draw.unchanged},
          {"tiles", {{"drawn", f.draw.tiles_drawn}, {"kept", f.draw.tiles_kept}}},
          {"cameras", f.draw.weights.cameras},
          {"weights", f.draw.weights.weights},
          {"samples", {{"drawn", f.draw.samples_drawn}}},
          {"pixels",
           {{"from_samples", f.draw.sample_pixels},
            {"from_base_layer", f.draw.base_pixels},
            {"filled", f.draw.filled_pixels}}},
          {"base_triangles", f.draw.base_triangles},
          {"contacts", f.step.contacts},
          {"tissue_contacts", f.step.tissue_contacts},
          {"tool_contacts", f.step.tool_contacts},
          {"collision_ms", f.step.collision_ms},
          {"tip_force_n", forces},
          {"tip_position_mm", places},
          {"tip_too_fast", f.step.tip_too_fast},
          {"slipped", f.step.slipped},
          {"closed_in_vain", f.step.closed_in_vain},
          {"tissue_penetration_mm", f.step.tissue_penetration_mm},
          {"recovered", f.step.recovered}};
}

constexpr double kCrossed_mm = 0.5;  // deeper than at rest; contacts close to within 0.02

Json summary_json(const std::vector<PlayedFrame>& frames) {
  std::vector<double> deform, draw, total;
  double collision_ms = 0, all_ms = 0;
  std::size_t unchanged = 0, recovered = 0;
  for (const PlayedFrame& f : frames) {
    unchanged += f.draw.unchanged;
    recovered += f.step.recovered;
    deform.push_back(f.deform_ms);
    collision_ms += f.step.collision_ms;
    all_ms += f.deform_ms + f.draw_ms;
    if (f.draw.unchanged) continue;  // a frame that was not drawn says nothing of drawing
    draw.push_back(f.draw_ms);
    total.push_back(f.deform_ms + f.draw_ms);
  }
  const double frame_ms = median(total);
  return {{"frames", frames.size()},
          {"frames_unchanged", unchanged},
          {"frames_recovered", recovered},
          {"median_deform_ms", median(deform)},
          {"median_draw_ms", median(draw)},
          {"collision_share_of_time", all_ms > 0 ? collision_ms / all_ms : 0},
          {"median_frames_per_second", frame_ms > 0 ? 1000 / frame_ms : 0}};
}

bool crossed(const PlayedFrame& frame) { return frame.step.tissue_penetration_mm > kCrossed_mm; }

// Tissue is held off tissue; where it is forced through, as by graspers, that is said once.
void warn_of_crossed_skin(const std::vector<PlayedFrame>& played, const RunContext& context) {
  const auto count = std::count_if(played.begin(), played.end(), crossed);
  if (count == 0) return;
  double deepest_mm = 0;
  for (const PlayedFrame& frame : played)
    deepest_mm = std::max(deepest_mm, frame.step.tissue_penetration_mm);
  context.warn("the skin passes through other skin in " + std::to_string(count) + " of " +
               std::to_string(played.size()) + " frames, by up to " + to_text(deepest_mm, 1) +
               " mm: the tissue is pushed or turned farther than its proxy can fold");
}

void set_vertices(const Script& script, int frame, Player& player) {
  const std::size_t state = std::size_t(frame) % script.vertices_mm.size();
  try {
    player.set_vertices(script.vertices_mm[state]);
  } catch (const UsageError& error) {
    throw UsageError("script '" + script.name + "': /vertices_mm/" + std::to_string(state) + ": " +
                     error.what());
  }
}

}  // namespace

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
  std::optional<ScriptTools> tools;
  if (options.instruments) tools.emplace(script, motion, player);
  player.reset();
  player.set_cut_times(std::nullopt);
  if (script.cuts_part_in)
    player.set_cut_times(
        Player::CutTimes{*script.cuts_part_in, std::numeric_limits<std::size_t>::max()});
  std::vector<PlayedFrame> played;
  Frame picture;
  const int frames = options.frames_of(script);
  for (int frame = 0; frame < frames; ++frame) {
    context.throw_if_cancelled();
    std::vector<Instrument> instruments = motion.at(frame * script.time_step_s);
    View view = view_at(script, frame, player.bundle().cameras, width, height);
    if (options.lens) view.camera.intrinsics = *options.lens;
    PlayedFrame& entry = played.emplace_back();
    Stopwatch watch;
    if (script.vertices_mm.empty())
      entry.step = player.step(instruments);
    else
      set_vertices(script, frame, player);
    entry.deform_ms = watch.lap();
    for (std::size_t i = 0; i < instruments.size(); ++i) {
      instruments[i].position_mm = entry.step.tip_position_mm[i];  // tools hold each other off
    }
    DrawOptions draw = options.draw;
    if (tools) draw.solids = tools->solids(instruments, frame * script.time_step_s);
    watch.lap();
    entry.draw = player.draw(view, draw, picture);
    entry.draw_ms = watch.lap();
    if (const auto why = why_empty(player, view, entry.draw))
      context.warn("frame " + std::to_string(frame) + ": " + *why);
    if (entry.step.recovered) {
      context.warn("frame " + std::to_string(frame) +
                   ": the tissue's state was lost and reset to rest");
    }
    if (entry.step.slipped > 0) {
      context.info("frame " + std::to_string(frame) + ": the tissue slipped from " +
                   (entry.step.slipped == 1 ? "a grasper" : "graspers") +
                   " that pulled with more than the grasp holds");
    }
    if (entry.step.closed_in_vain > 0) {
      context.warn("frame " + std::to_string(frame) +
                   ": a grasper closed deep in the tissue, or on skin that anchors hold, where it "
                   "holds nothing; let its path begin at free skin");
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
  }
  warn_of_crossed_skin(played, context);
  return played;
}

std::string play_report(const Script& script, const Player& player,
                        const std::vector<PlayedFrame>& frames) {
  Json list = Json::array();
  for (const PlayedFrame& frame : frames) list.push_back(frame_json(frame));
  return json_text({{"schema", "organbake/play-report/1"},
                    {"script", script.name},
                    {"time_step_s", script.time_step_s},
                    {"solver", to_string(player.solver())},
                    {"organs", player.organ_count()},
                    {"summary", summary_json(frames)},
                    {"frames", list}});
}

}  // namespace organbake
