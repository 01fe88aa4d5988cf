// SPDX-License-Identifier: Apache-2.0
#include "organbake/dataset/dataset.h"

#include "dataset_shard.h"
#include "organbake/image/srgb.h"
#include "organbake/player/script.h"
#include "support/error_message.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

std::string spec_with(const std::string& more) {
  return R"({"schema": "organbake/dataset/1", "frames": 7)" + more + "}";
}

TEST(DatasetSpec, DefaultsAreValidAndWrittenBack) {
  const DatasetSpec spec = dataset_spec_from_json(spec_with(""), "d.json");
  EXPECT_EQ(spec.frames, 7);
  EXPECT_EQ(spec.width, 640);
  EXPECT_FALSE(spec.layers.any());
  const std::string text = dataset_spec_to_json(spec);
  EXPECT_EQ(dataset_spec_to_json(dataset_spec_from_json(text, "again.json")), text);
}

TEST(DatasetSpec, ReadsEverything) {
  const DatasetSpec spec = dataset_spec_from_json(
      spec_with(R"(, "name": "n", "seed": 9, "clip_frames": 4, "shard_frames": 8, "size": [32, 24],
        "layers": ["depth", "mask"], "stereo_mm": 5, "test_share": 0.5, "time_step_s": 0.02,
        "views": {"cone_deg": 30, "distance": 1, "roll_rad": 0.1, "motion_deg": 12.5},
        "pokes": {"count": [1, 2], "depth_mm": [1, 3], "radius_mm": 4, "cone_deg": 5,
                  "tools": ["poke", "grab", "cut"]},
        "lights": ["world", "scope"], "gain": [0.5, 2], "noise": 3, "stiffness": [0.5, 2])"),
      "d.json");
  EXPECT_TRUE(spec.layers.depth && spec.layers.mask && !spec.layers.flow);
  EXPECT_EQ(spec.most_pokes, 2);
  EXPECT_EQ(spec.radius_mm.low, 4);
  EXPECT_EQ(spec.radius_mm.high, 4);
  EXPECT_EQ(spec.lights.size(), 2u);
  EXPECT_NEAR(spec.cone_rad, std::numbers::pi / 6, 1e-12);
  EXPECT_EQ(spec.roll_rad, 0.1);
  EXPECT_EQ(spec.stiffness.high, 2);
  EXPECT_EQ(spec.tools.size(), 3u);
  const std::string text = dataset_spec_to_json(spec);
  EXPECT_EQ(dataset_spec_to_json(dataset_spec_from_json(text, "again.json")), text);
}

TEST(DatasetSpec, PicturesHaveTheSizeOfTheirLensUnlessToldOtherwise) {
  const std::string lens = R"(, "lens": {"width": 80, "height": 60, "fx": 70, "fy": 72, "cx": 41,
      "cy": 30, "distortion_k1_k2_p1_p2_k3": [-0.2, 0.05, 0.001, -0.002, 0.01],
      "vignette_exponent": 3})";
  const DatasetSpec spec = dataset_spec_from_json(spec_with(lens), "d.json");
  ASSERT_TRUE(spec.lens);
  EXPECT_EQ(spec.width, 80);
  EXPECT_EQ(spec.height, 60);
  EXPECT_EQ(spec.lens->intrinsics.p2, -0.002);
  const DatasetSpec half =
      dataset_spec_from_json(spec_with(lens + R"(, "size": [40, 30])"), "d.json");
  EXPECT_EQ(half.width, 40);
  EXPECT_EQ(half.lens->intrinsics.width, 40);
  EXPECT_EQ(half.lens->intrinsics.fx, 35);
  const std::string text = dataset_spec_to_json(half);
  EXPECT_EQ(dataset_spec_to_json(dataset_spec_from_json(text, "again.json")), text);
}

TEST(DatasetSpec, NamesWhatIsWrong) {
  const auto refusal = [](const std::string& more) -> std::string {
    return message_of(ExitCode::bad_data,
                      [&] { dataset_spec_from_json(spec_with(more), "d.json"); });
  };
  EXPECT_TRUE(refusal(R"(, "gain": [2, 1])").starts_with("d.json: /gain"));
  EXPECT_TRUE(refusal(R"(, "stiffness": 0)").starts_with("d.json: /stiffness"));
  EXPECT_TRUE(refusal(R"(, "layers": ["deep"])").starts_with("d.json: /layers"));
  EXPECT_TRUE(refusal(R"(, "lights": ["sun"])").starts_with("d.json: /lights/0"));
  EXPECT_TRUE(refusal(R"(, "pokes": {"count": 1.5})").starts_with("d.json: /pokes/count"));
  EXPECT_EQ(
      refusal(R"(, "pokes": {"depth_mm": [0.002, 0.01]})"),
      "d.json: /pokes/depth_mm: is [0.002,0.01], less than a tenth of a millimetre; it is in mm: "
      "2 to 10?");
  EXPECT_TRUE(refusal(R"(, "pokes": {"tools": ["pinch"]})").starts_with("d.json: /pokes/tools/0"));
  EXPECT_TRUE(refusal(R"(, "views": {"cone_deg": 5, "cone_rad": 0.1})")
                  .starts_with("d.json: /views/cone_rad: is another unit of cone_deg"));
  EXPECT_TRUE(refusal(R"(, "views": {"cone_deg": 200})").starts_with("d.json: /views/cone_deg"));
  EXPECT_TRUE(refusal(R"(, "shard_frames": 3)").starts_with("d.json: /shard_frames"));
  EXPECT_TRUE(refusal(R"(, "views": {"cone": 1})").starts_with("d.json: /views"));
  EXPECT_TRUE(refusal(R"(, "lens": {"width": 80, "height": -6})").starts_with("d.json: /lens: /h"));
  EXPECT_TRUE(refusal(R"(, "test_share": -0.1)").starts_with("d.json: /test_share"));
}

DatasetPlan plan_of(int frames, std::size_t organs, double test_share, std::uint64_t seed = 1) {
  DatasetSpec spec;
  spec.frames = frames;
  spec.clip_frames = 4;
  spec.shard_frames = 10;  // holds two clips
  spec.test_share = test_share;
  spec.seed = seed;
  return plan_dataset(spec, std::vector<std::filesystem::path>(organs, "some/organ name/"));
}

TEST(DatasetPlan, HandsOutWholeClipsEvenly) {
  const DatasetPlan plan = plan_of(41, 3, 0.3);  // 11 clips: 4, 4 and 3
  EXPECT_EQ(plan.frames, 44);
  int clips[3] = {};
  std::set<std::string> folders;
  for (const DatasetShard& shard : plan.shards) {
    EXPECT_EQ(shard.first_clip, clips[shard.organ]);
    EXPECT_LE(shard.clips, 2);
    clips[shard.organ] += shard.clips;
    folders.insert(shard.folder);
  }
  EXPECT_EQ(clips[0], 4);
  EXPECT_EQ(clips[1], 4);
  EXPECT_EQ(clips[2], 3);
  EXPECT_EQ(folders.size(), plan.shards.size());
}

TEST(DatasetPlan, KeepsAnOrganOnOneSide) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const DatasetPlan plan = plan_of(400, 5, 0.4, seed);
    const auto tests = std::count_if(plan.organs.begin(), plan.organs.end(),
                                     [](const DatasetOrgan& organ) { return organ.test; });
    EXPECT_EQ(tests, 2);
    for (const DatasetShard& shard : plan.shards)
      EXPECT_EQ(shard.folder.starts_with("test/"), plan.organs[shard.organ].test);
  }
  const auto tests_of = [](std::size_t organs, double share) {
    const DatasetPlan plan = plan_of(100, organs, share);
    return std::count_if(plan.organs.begin(), plan.organs.end(),
                         [](const DatasetOrgan& organ) { return organ.test; });
  };
  EXPECT_EQ(tests_of(1, 0.5), 0);
  EXPECT_EQ(tests_of(2, 0.01), 1);
  EXPECT_EQ(tests_of(3, 1), 2);
  EXPECT_EQ(tests_of(3, 0), 0);
}

const Bundle& organ_of_clips() {
  static const Bundle bundle = [] {
    SyntheticOptions options;
    options.map_size = 32;
    options.base_step_mm = 12;
    return make_synthetic_bundle(options);
  }();
  return bundle;
}

DatasetSpec spec_of_clips() {
  DatasetSpec spec;
  spec.cone_rad = 0.4;
  spec.distance = {0.9, 1.1};
  spec.motion_rad = 0.05;
  spec.fewest_pokes = 1, spec.most_pokes = 3;
  spec.gain = {0.5, 2};
  spec.noise = {1, 4};
  spec.stiffness = {0.5, 2};
  return spec;
}

TEST(Clip, StaysWithinItsSpec) {
  const Bundle& bundle = organ_of_clips();
  const DatasetSpec spec = spec_of_clips();
  const Eigen::Vector3d center = bundle.cameras.manifold.center_world_mm,
                        eye = bundle.cameras.cameras[0].center_world_mm();
  double widest = 0;
  for (int i = 0; i < 200; ++i) {
    const DatasetClip clip = make_clip(spec, bundle, 2, i);
    const View first = view_at(clip.script, 0, bundle.cameras, 64, 48),
               last = view_at(clip.script, spec.clip_frames - 1, bundle.cameras, 64, 48);
    const Eigen::Vector3d from = first.camera.center_world_mm() - center,
                          to = last.camera.center_world_mm() - center;
    const auto angle = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      return std::acos(std::min(1.0, a.normalized().dot(b.normalized())));
    };
    EXPECT_LE(angle(from, eye - center), spec.cone_rad + 1e-9);
    EXPECT_LE(angle(from, to), spec.motion_rad + 1e-7);
    widest = std::max(widest, angle(from, eye - center));
    const double distance = from.norm() / (eye - center).norm();
    EXPECT_GE(distance, 0.9 - 1e-9);
    EXPECT_LE(distance, 1.1 + 1e-9);
    EXPECT_GE(clip.script.instruments.size(), 1u);
    EXPECT_LE(clip.script.instruments.size(), 3u);
    EXPECT_GE(clip.gain, 0.5);
    EXPECT_LE(clip.noise, 4);
    EXPECT_TRUE(clip.stiffness >= 0.5 && clip.stiffness <= 2);
  }
  EXPECT_GT(widest, 0.9 * spec.cone_rad);
}

TEST(Clip, HoldsTheToolsThatAreAskedFor) {
  DatasetSpec spec = spec_of_clips();
  spec.tools = {Grasper(), Blade()};
  int graspers = 0, hooks = 0;
  for (int i = 0; i < 40; ++i) {
    const DatasetClip clip = make_clip(spec, organ_of_clips(), 0, i);
    for (const InstrumentPath& tool : clip.script.instruments) {
      const bool grasps = tool.instrument.is<Grasper>();
      ASSERT_TRUE(grasps || tool.instrument.is<Blade>());
      ++(grasps ? graspers : hooks);
      const double last = tool.path.back().depth_mm;
      EXPECT_TRUE(grasps ? last < 0 : last > 0) << "graspers pull out, hooks stay in tissue";
    }
    const std::string text = script_to_json(clip.script);
    EXPECT_EQ(script_to_json(script_from_json(text, "clip")), text);
  }
  EXPECT_GT(graspers, 15);
  EXPECT_GT(hooks, 15);
}

TEST(Clip, FollowsFromSeedOrganAndNumberAlone) {
  const auto text = [](std::uint64_t seed, std::size_t organ, int number) {
    DatasetSpec spec = spec_of_clips();
    spec.seed = seed;
    return script_to_json(make_clip(spec, organ_of_clips(), organ, number).script);
  };
  EXPECT_EQ(text(1, 0, 5), text(1, 0, 5));
  EXPECT_NE(text(1, 0, 5), text(2, 0, 5));
  EXPECT_NE(text(1, 0, 5), text(1, 1, 5));
  EXPECT_NE(text(1, 0, 5), text(1, 0, 6));
}

TEST(Expose, AddsNoiseOfTheDeviationThatWasAsked) {
  Rgb8Image grey(200, 100);
  std::fill(grey.pixels.begin(), grey.pixels.end(), std::uint8_t{120});
  Rgb8Image noisy = grey, other = grey, again = grey;
  expose(1, 5, 1, 7, noisy);
  expose(1, 5, 1, 8, other);
  expose(1, 5, 1, 7, again);
  EXPECT_EQ(noisy.pixels, again.pixels);
  EXPECT_NE(noisy.pixels, other.pixels);
  double sum = 0, squares = 0;
  for (const std::uint8_t value : noisy.pixels) sum += value, squares += double(value) * value;
  const double n = double(noisy.pixels.size()), mean = sum / n;
  // 60,000 values: the mean is good to 0.02, the deviation to 0.015; three times that, and the
  // rounding's own twelfth.
  EXPECT_NEAR(mean, 120, 0.06);
  EXPECT_NEAR(std::sqrt(squares / n - mean * mean), std::sqrt(25 + 1.0 / 12), 0.05);
}

TEST(Expose, ScalesLinearLight) {
  Rgb8Image picture(1, 1);
  picture.pixels = {100, 200, 255};
  expose(0.5, 0, 1, 0, picture);
  EXPECT_EQ(picture.pixels[0], srgb8_from_linear(0.5f * linear_from_srgb8()[100]));
  EXPECT_EQ(picture.pixels[2], srgb8_from_linear(0.5f));
  const Rgb8Image before = picture;
  expose(1, 0, 1, 0, picture);
  EXPECT_EQ(picture.pixels, before.pixels);
}

}  // namespace
}  // namespace organbake
