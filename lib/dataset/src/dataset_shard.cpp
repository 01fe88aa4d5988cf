// SPDX-License-Identifier: Apache-2.0
#include "dataset_shard.h"

#include <algorithm>
#include <memory>

#include "clip.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/background_tasks.h"
#include "organbake/core/files.h"
#include "organbake/image/png.h"
#include "organbake/player/play.h"
#include "organbake/player/reference_frames.h"
#include "organbake/truth/truth_recorder.h"

namespace organbake {
namespace {

// Files are packed and written while the next frames are played; not many at once, each holds its
// planes.
class Writers {
 public:
  void run(WriteJob job) {
    constexpr int kFilesAThread = 8;
    if (++waiting_ > kFilesAThread * BackgroundTasks::most_at_the_time()) wait();
    tasks_.run(std::move(job));
  }
  void wait() {
    tasks_.wait();  // throws what a job threw
    waiting_ = 0;
  }

 private:
  BackgroundTasks tasks_;
  int waiting_ = 0;
};

// What the card tells of a shard.
struct Counts {
  int frames = 0, frames_with_contact = 0;
  double largest_force_n = 0;

  void add(const StepReport& step) {
    ++frames;
    frames_with_contact += step.contacts > 0;
    for (const Eigen::Vector3d& force : step.tip_force_n)
      largest_force_n = std::max(largest_force_n, force.norm());
  }
};

Json clip_json(const DatasetClip& clip, int first_frame, DrawnLight light) {
  return {{"first_frame", first_frame},
          {"frames", clip.script.frames},
          {"instruments", clip.script.instruments.size()},
          {"light", to_string(light)},
          {"gain", clip.gain},
          {"noise", clip.noise}};
}

// Names a picture among all of a data set.
std::uint64_t item_of(const DatasetShard& shard, const DatasetSpec& spec, int frame, bool right) {
  const std::uint64_t of_organ =
      std::uint64_t(shard.first_clip) * std::uint64_t(spec.clip_frames) + std::uint64_t(frame);
  return (std::uint64_t(shard.organ) << 40) + 2 * of_organ + (right ? 1 : 0);
}

}  // namespace

void make_shard(const DatasetSpec& spec, const std::shared_ptr<const LensPicture>& lens,
                const DatasetShard& shard, Player& player, const std::filesystem::path& dataset,
                const RunContext& context) {
  AtomicFolder folder(dataset / shard.folder);
  Writers writers;
  DrawOptions draw;
  draw.keep_bound = true;
  TruthOptions truth;
  truth.layers = spec.layers;
  truth.baseline_mm = spec.baseline_mm;
  truth.lens = lens;
  truth.run = [&](WriteJob job) { writers.run(std::move(job)); };
  TruthRecorder recorder(folder.path(), truth, draw);
  Counts counts;
  Json clips = Json::array();
  const Bounds organs = rest_bounds(player);
  for (int c = 0; c < shard.clips; ++c) {
    const DatasetClip clip = make_clip(spec, player.bundle(), shard.organ, shard.first_clip + c);
    draw.light = clip.script.light.value_or(player.default_light());
    TruthClip part;
    part.first_frame = c * spec.clip_frames;
    part.light = draw.light;
    for (const InstrumentPath& instrument : clip.script.instruments)
      part.instruments.push_back(instrument.name);
    const auto expose_frame = [&spec, &shard, gain = clip.gain, noise = clip.noise](
                                  int frame, bool right, Rgb8Image& picture) {
      expose(gain, noise, spec.seed, item_of(shard, spec, frame, right), picture);
    };
    part.expose_right = [expose_frame](int frame, Rgb8Image& picture) {
      expose_frame(frame, true, picture);
    };
    recorder.begin(part);
    PlayOptions options;
    options.draw = draw;
    if (lens) options.lens = lens->pinhole(), lens->prepare(options.draw);
    options.watch = [&](const PlayedScene& scene) {
      counts.add(scene.step);
      const int frame = part.first_frame + scene.frame;
      const auto drawn = std::make_shared<Frame>();
      drawn->color = scene.picture.color;
      if (lens) drawn->cover = scene.picture.cover, drawn->depth_mm = scene.picture.depth_mm;
      writers.run([expose_frame, lens, frame, drawn, view = scene.view, organs,
                   file = folder.path() / frame_file_name(frame)] {
        constexpr int kQuick = 1;  // PNG level
        Rgb8Image seen;
        if (lens) lens->show({*drawn, view, organs}, seen);
        Rgb8Image* const picture = lens ? &seen : &drawn->color;
        expose_frame(frame, false, *picture);
        write_png(file, *picture, kQuick);
      });
      recorder.add(player, scene);
      const double done = double(frame + 1) / (shard.clips * spec.clip_frames);
      context.progress(shard.begin + done * (shard.end - shard.begin));
    };
    play(player, clip.script, options, {}, context);
    clips.push_back(clip_json(clip, part.first_frame, draw.light));
  }
  recorder.finish();
  writers.wait();
  write_file_atomically(folder.path() / "shard.json",
                        json_text({{"frames", counts.frames},
                                   {"frames_with_contact", counts.frames_with_contact},
                                   {"largest_force_n", counts.largest_force_n},
                                   {"clips", clips}}));
  context.throw_if_cancelled();
  folder.commit();
}

}  // namespace organbake
