// SPDX-License-Identifier: Apache-2.0
// One shard: clips of random views, lights and pokes from its own random stream, played and
// recorded with their truth.
#include "dataset_shard.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/background.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/image/png.h"
#include "organbake/player/skin_point.h"
#include "organbake/truth/truth_recorder.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Evenly over the cap of directions within an angle of another.
Vector3d in_cone(const Vector3d& middle, double angle_rad, RandomStream& random) {
  const double cosine = random.uniform(std::cos(angle_rad), 1),
               turn = random.uniform(0, 2 * std::numbers::pi),
               sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const Vector3d aside = middle.unitOrthogonal(), other = middle.cross(aside);
  return cosine * middle + sine * (std::cos(turn) * aside + std::sin(turn) * other);
}

RigidTransform view_along(const Bundle& bundle, const Vector3d& direction, double distance,
                          double roll_rad) {
  const Vector3d center = bundle.cameras.manifold.center_world_mm;
  const Vector3d to_first = bundle.cameras.cameras.front().center_world_mm() - center;
  const RigidTransform roll = {Eigen::AngleAxisd(roll_rad, Vector3d::UnitZ()).toRotationMatrix(),
                               Vector3d::Zero()};
  return roll * look_at(center + distance * to_first.norm() * direction, center, up_from(to_first));
}

double drawn_from(const SampledRange& range, RandomStream& random) {
  return random.uniform(range.low, range.high);
}

bool meets_skin(const Bundle& bundle, const Vector3d& direction) {
  try {
    skin_place(bundle, direction);
    return true;
  } catch (const BadDataError&) {
    return false;
  }
}

// In and out again, once; or skin held from early on and pulled out; or an edge through tissue from
// one direction to another. All where there is skin.
std::optional<InstrumentPath> make_poke(const DatasetSpec& spec, const Bundle& bundle,
                                        const Vector3d& view, int number, RandomStream& random) {
  const double depth = drawn_from(spec.depth_mm, random),
               radius = drawn_from(spec.radius_mm, random);
  const double all = spec.clip_frames * spec.time_step_s;
  const double deepest = random.uniform(0.4, 0.8) * all;
  const double begins = 0.1 * all, ends = all + spec.time_step_s;
  constexpr int kTries = 8;
  constexpr double kAbove_mm = 2, kGrip_mm = 1;
  constexpr double kHook_mm = 0.5, kHookEdge_mm = 30, kHookWidth_mm = 1.5, kStroke_rad = 0.3;
  const InstrumentKind tool =
      spec.tools.empty() ? Ball() : spec.tools[random.below(spec.tools.size())];
  for (int i = 0; i < kTries; ++i) {
    const Vector3d from = in_cone(view, spec.poke_cone_rad, random);
    if (!meets_skin(bundle, from)) continue;
    InstrumentPath path;
    path.instrument.kind = tool;
    path.instrument.radius_mm = radius;
    if (std::holds_alternative<Grasper>(tool)) {
      path.name = "grasper " + std::to_string(number);
      path.path = {{begins, std::nullopt, from, kGrip_mm},
                   {deepest, std::nullopt, from, -depth},
                   {ends, std::nullopt, from, -depth}};
    } else if (std::holds_alternative<Blade>(tool)) {
      const Vector3d to = in_cone(from, kStroke_rad, random);
      if (!meets_skin(bundle, to)) continue;
      path.name = "hook " + std::to_string(number);
      path.instrument.radius_mm = kHook_mm;
      path.instrument.kind = Blade{kHookWidth_mm};
      path.instrument.axis_mm = kHookEdge_mm * from;
      path.path = {{begins, std::nullopt, from, depth}, {deepest, std::nullopt, to, depth}};
    } else {
      path.name = "probe " + std::to_string(number);
      path.path = {{0, std::nullopt, from, -kAbove_mm},
                   {deepest, std::nullopt, from, depth},
                   {ends, std::nullopt, from, -kAbove_mm}};
    }
    return path;
  }
  return std::nullopt;
}

}  // namespace

DatasetClip make_clip(const DatasetSpec& spec, const Bundle& bundle, std::size_t organ,
                      int number) {
  constexpr std::uint64_t kClipsOfOrgan = std::uint64_t{1} << 32;
  RandomStream random(spec.seed, organ * kClipsOfOrgan + static_cast<std::uint64_t>(number));
  DatasetClip clip;
  Script& script = clip.script;
  script.name = "clip " + std::to_string(number);
  script.time_step_s = spec.time_step_s;
  script.frames = spec.clip_frames;
  script.width = spec.width, script.height = spec.height;
  const Vector3d front =
      (bundle.cameras.cameras.front().center_world_mm() - bundle.cameras.manifold.center_world_mm)
          .normalized();
  const Vector3d from = in_cone(front, spec.cone_rad, random),
                 to = in_cone(from, spec.motion_rad, random);
  const double distance = drawn_from(spec.distance, random),
               roll = random.uniform(-spec.roll_rad, spec.roll_rad);
  script.camera.push_back({0, {}, view_along(bundle, from, distance, roll)});
  if (spec.clip_frames > 1)
    script.camera.push_back({spec.clip_frames - 1, {}, view_along(bundle, to, distance, roll)});
  const auto pokes =
      spec.fewest_pokes +
      static_cast<int>(random.below(std::uint64_t(spec.most_pokes - spec.fewest_pokes) + 1));
  for (int i = 0; i < pokes; ++i)
    if (auto poke = make_poke(spec, bundle, from, i, random))
      script.instruments.push_back(std::move(*poke));
  if (!spec.lights.empty()) script.light = spec.lights[random.below(spec.lights.size())];
  clip.gain = drawn_from(spec.gain, random);
  clip.noise = drawn_from(spec.noise, random);
  clip.stiffness = drawn_from(spec.stiffness, random);
  return clip;
}

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
          {"noise", clip.noise},
          {"stiffness", clip.stiffness}};
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
  truth.tracks = spec.tracks;
  truth.lens = lens;
  truth.run = [&](WriteJob job) { writers.run(std::move(job)); };
  TruthRecorder recorder(folder.path(), truth, draw);
  Counts counts;
  Json clips = Json::array();
  const Bounds organs = rest_bounds(player);
  for (int c = 0; c < shard.clips; ++c) {
    const DatasetClip clip = make_clip(spec, player.bundle(), shard.organ, shard.first_clip + c);
    player.set_stiffness(clip.stiffness);
    draw.light = player.light_for(clip.script.light);
    TruthClip part;
    part.first_frame = c * spec.clip_frames;
    part.light = *draw.light;
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
    clips.push_back(clip_json(clip, part.first_frame, *part.light));
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
