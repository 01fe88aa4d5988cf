// SPDX-License-Identifier: Apache-2.0
#include "organplay.h"

#include <algorithm>
#include <array>
#include <utility>

#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/stopwatch.h"
#include "organbake/core/text.h"
#include "organbake/player/skin_point.h"

namespace organbake {
namespace {

// A second in and a second out, again and again, while the eye goes round.
Script bench_script(const Command& command) {
  Script script;
  script.name = "bench";
  script.frames = command.bench_frames;
  script.width = command.picture_size().width;
  script.height = command.picture_size().height;
  constexpr double kRadiansPerFrame = 0.01;
  script.camera = {{0, {}}, {command.bench_frames, {kRadiansPerFrame * command.bench_frames, 0.1}}};
  return script;
}

void add_pokes(Script& script, const Bundle& bundle) {
  const Eigen::Vector3d front = poke_direction(bundle);
  const double deep = 0.2 * thickness_mm(bundle, front);
  InstrumentPath probe{"probe"};
  const double seconds = script.frames * script.time_step_s;
  for (int i = 0; i <= seconds + 1; ++i) {
    probe.path.push_back({double(i), std::nullopt, front, i % 2 == 0 ? -1.0 : deep});
  }
  script.instruments.push_back(probe);
}

// What --layers cost beside each frame.
class TruthTimes {
 public:
  explicit TruthTimes(const LayerSet& layers) : tracker_(layers) {}

  void watch(const Player& player, const PlayedScene& scene) {
    Stopwatch watch;
    tracker_.advance(player, scene.view, scene.solids, scene.picture);
    if (tracker_.layers().flow && tracker_.has_before()) tracker_.find_forward(forward_);
    ms_.push_back(watch.lap());
  }
  double median_ms() const { return median(ms_); }

 private:
  TruthTracker tracker_;
  Flow forward_;
  std::vector<double> ms_;
};

double median_of(const std::vector<PlayedFrame>& frames, const auto& value) {
  std::vector<double> values;
  for (const PlayedFrame& f : frames) values.push_back(value(f));
  return median(values);
}

constexpr std::array<std::pair<const char*, double DrawTimes::*>, 5> kPhases = {
    {{"transform", &DrawTimes::transform},
     {"splat", &DrawTimes::splat},
     {"base", &DrawTimes::base},
     {"resolve", &DrawTimes::resolve},
     {"fill", &DrawTimes::fill}}};

void add_phases(const std::vector<PlayedFrame>& frames, DrawTimes DrawReport::*times, Json& ms) {
  for (const auto& [name, phase] : kPhases)
    ms[name] = median_of(frames, [&](const auto& f) { return f.draw.*times.*phase; });
}

Json medians(const std::vector<PlayedFrame>& frames) {
  Json ms = {{"deform", median_of(frames, [](const auto& f) { return f.deform_ms; })},
             {"draw", median_of(frames, [](const auto& f) { return f.draw_ms; })}};
  add_phases(frames, &DrawReport::times, ms);
  ms["frame"] = median_of(frames, [](const auto& f) { return f.deform_ms + f.draw_ms; });
  return ms;
}

// A frame's work, and its longest chain: deforming is one.
struct FrameSpan {
  int threads = allowed_threads();
  double work_ms, chain_ms;
  Json by_phase;

  explicit FrameSpan(const std::vector<PlayedFrame>& frames)
      : work_ms(
            median_of(frames, [](const auto& f) { return f.deform_ms + f.draw.times.total(); })),
        chain_ms(median_of(
            frames, [](const auto& f) { return f.deform_ms + f.draw.critical_path.total(); })) {
    by_phase["deform"] = median_of(frames, [](const auto& f) { return f.deform_ms; });
    add_phases(frames, &DrawReport::critical_path, by_phase);
    by_phase["frame"] = chain_ms;
  }
  // See WorkSpan.
  double most_speedup() const { return work_ms / std::max(work_ms / threads, chain_ms); }
};

std::string spaces_for(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, text.size()), ' ');
}
std::string left_aligned(const std::string& text, std::size_t width) {
  return text + spaces_for(text, width);
}
std::string right_aligned(const std::string& text, std::size_t width) {
  return spaces_for(text, width) + text;
}

}  // namespace

void run_bench(const Command& command, const RunContext& context) {
  Stopwatch watch;
  DeformOptions deform;
  deform.solver = command.solver;
  Player player(command.bundles, deform);
  draw_as_asked(command, player, context);
  Frame first;
  player.draw(view_of(command, player), drawing(command, player), first);
  const double first_frame_ms = watch.lap();
  context.throw_if_cancelled();
  player.load_all();  // what the timed frames shall not wait for
  const double all_cameras_ms = first_frame_ms + watch.lap();

  Script script = bench_script(command);
  add_pokes(script, player.bundle());
  PlayOptions options;
  options.instruments = false;
  options.draw = drawing(command, player);
  options.draw.measure = true;
  TruthTimes truth(command.layers);
  options.draw.keep_bound = command.layers.any();
  if (command.layers.any())
    options.watch = [&](const PlayedScene& scene) { truth.watch(player, scene); };
  const std::vector<PlayedFrame> played = play(player, script, options, {}, context);
  warn_of_processor(command, player, context);
  Json ms = medians(played);
  const FrameSpan span(played);
  if (command.layers.any()) {
    ms["truth"] = truth.median_ms();
    ms["frame"] = ms["frame"].get<double>() + truth.median_ms();
  }
  const double fps = 1000 / ms["frame"].get<double>();
  if (command.shared.json) {
    write_to_stdout(json_text(
        {{"frames", script.frames},
         {"width", script.width},
         {"height", script.height},
         {"load_to_first_frame_ms", first_frame_ms},
         {"load_all_cameras_ms", all_cameras_ms},
         {"median_ms", ms},
         {"critical_path_ms", span.by_phase},
         {"threads", span.threads},
         {"most_speedup", span.most_speedup()},
         {"peak_memory_mb", number_behind("VmHWM:", "/proc/self/status").value_or(0) / 1024},
         {"frames_per_second", fps}}));
    return;
  }
  std::string text = "load to first frame  " + to_text(first_frame_ms, 1) + " ms, all cameras " +
                     to_text(all_cameras_ms, 1) + " ms\n";
  for (const auto& [phase, value] : ms.items()) {
    text += left_aligned(phase, 10) + " " + right_aligned(to_text(value.get<double>(), 3), 8) +
            " ms (median of " + std::to_string(script.frames) + ")";
    if (span.by_phase.contains(phase))
      text += ", longest chain " +
              right_aligned(to_text(span.by_phase[phase].get<double>(), 3), 8) + " ms";
    text += "\n";
  }
  text += "work of " + to_text(span.work_ms, 3) + " ms with a longest chain of " +
          to_text(span.chain_ms, 3) + " ms: " + std::to_string(span.threads) +
          (span.threads == 1 ? " thread can" : " threads can") + " be " +
          to_text(span.most_speedup(), 2) + " times as fast as one, and no faster\n";
  write_to_stdout(text + to_text(fps, 1) + " frames per second at " + std::to_string(script.width) +
                  "x" + std::to_string(script.height) + "\n");
}

}  // namespace organbake
