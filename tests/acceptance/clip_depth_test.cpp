// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <numbers>

#include "measuring/scenes.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/phantom/phantom.h"
#include "organbake/registration/object_pose.h"
#include "organbake/registration/register_photo.h"
#include "organbake/shading/frame_depth.h"
#include "promises.h"

namespace organbake {
namespace {

struct ClipShares {
  double error = 0, recall = 0, false_alarm = 0;
};

ClipShares measure_clip(const LaparoscopyPhantom& phantom, int frames, bool piecewise_albedo) {
  ClipShares mean;
  FrameDepth previous;
  for (int i = 0; i < frames; ++i) {
    const LaparoscopyFrame truth = phantom.frame(i);
    const PreparedFrame frame =
        prepare_frame(truth.image, truth.camera.intrinsics, {.piecewise_albedo = piecewise_albedo});
    FrameDepth depth = shade_frame(frame, {}, i > 0 ? &previous : nullptr);
    double shift = 0, count = 0, sum = 0, lights = 0, hit = 0, clean = 0, taken = 0;
    for (int pass = 0; pass < 2; ++pass)
      for (std::size_t k = 0; k < depth.depth.size(); ++k) {
        if (!frame.diffuse.values[k] || !std::isfinite(truth.depth_mm.values[k])) continue;
        const double ratio = std::log(depth.depth.values[k] / truth.depth_mm.values[k]);
        shift += pass == 0 ? ratio : 0;
        count += pass == 0;
        sum += pass == 1 ? std::abs(std::exp(ratio - shift / count) - 1) : 0;
      }
    for (std::size_t k = 0; k < depth.depth.size(); ++k) {
      if (!frame.field.values[k] || truth.instrument.values[k]) continue;
      const bool masked = !frame.diffuse.values[k];
      (truth.highlights.values[k] ? lights : clean) += 1;
      (truth.highlights.values[k] ? hit : taken) += masked;
    }
    mean.error += 100 * sum / count / frames;
    mean.recall += 100 * hit / std::max(1.0, lights) / frames;
    mean.false_alarm += 100 * taken / std::max(1.0, clean) / frames;
    previous = std::move(depth);
  }
  return mean;
}

TEST(LaparoscopyClip, IsShadedWhereItIsTissue) {
  const int frames = cases(4, 8);
  const ClipShares shares =
      measure_clip(LaparoscopyPhantom(LaparoscopyOptions{.frames = frames}), frames, true);
  expect({"phantom clip: relative error on unmasked tissue", "%", shares.error, 3});
  expect({"phantom clip: highlights masked", "%", shares.recall, 90, Figure::Goal::at_least});
  expect({"phantom clip: clean tissue masked", "%", shares.false_alarm, 5});
}

// What bringing two tissues to one albedo is worth, where there are two and where there is one.
TEST(LaparoscopyClip, OfTwoTissuesIsBetterShadedTissueByTissue) {
  const int frames = cases(2, 4);
  for (const bool two : {true, false}) {
    const LaparoscopyPhantom phantom({.frames = frames, .two_tissues = two});
    const double by_tissue = measure_clip(phantom, frames, true).error;
    const double as_one = measure_clip(phantom, frames, false).error;
    const std::string what = two ? "phantom clip, two tissues: " : "phantom clip, one tissue: ";
    report(what + "relative depth error, one albedo", "%", as_one);
    expect({what + "relative depth error, albedo by tissue", "%", by_tissue,
            two ? as_one : 1.1 * as_one});
  }
}

// What of the left picture lies in the right eye's view, too, by the true depths: its round field
// misses a tenth of the left one's at 40…100 mm, and each eye looks past the instrument otherwise.
Mask seen_by_both(const EyePair& pair) {
  constexpr float kOneSurface = 0.03F;  // of the depth
  const RectifiedEyes& eyes = pair.rectifier.eyes();
  const Plane &left = pair.left.depth_mm, &right = pair.right.depth_mm;
  Mask both(left.width, left.height);
  for (int y = 0; y < left.height; ++y)
    for (int x = 0; x < left.width; ++x) {
      const double disparity =
          eyes.disparity_at_infinity + eyes.camera.fx * eyes.baseline_mm / left.at(x, y);
      const auto column = static_cast<int>(std::lround(x - disparity));
      if (!std::isfinite(left.at(x, y)) || column < 0) continue;
      both.at(x, y) =
          std::abs(right.at(column, y) / left.at(x, y) - 1) < kOneSurface;  // inf: not in view
    }
  return both;
}

TEST(StereoLaparoscope, TellsDistancesOfMostTissue) {
  const int scenes = cases(3, 8);
  double mean = 0, bad = 0, dense = 0;
  for (int seed = 1; seed <= scenes; ++seed) {
    const EyePair pair(720, 576, seed);
    Mask tissue;
    const StereoDepth found = pair.matched(&tissue);
    const Mask in_both = seen_by_both(pair);
    double sum = 0, off = 0, count = 0, all = 0, told = 0;
    for (std::size_t k = 0; k < tissue.size(); ++k) {
      const double truth = pair.left.depth_mm.values[k];
      if (!tissue.values[k] || !std::isfinite(truth)) continue;
      const bool has_depth = std::isfinite(found.depth.depth.values[k]);
      all += in_both.values[k];
      told += in_both.values[k] && has_depth;
      if (!has_depth) continue;
      const double relative = std::abs(found.depth.depth.values[k] / truth - 1);
      sum += relative;
      off += relative > 0.03;
      ++count;
    }
    mean += 100 * sum / std::max(1.0, count) / scenes;
    bad += 100 * off / std::max(1.0, count) / scenes;
    dense += 100 * told / std::max(1.0, all) / scenes;
  }
  expect({"stereo, phantom at 40…100 mm: relative error, metric", "%", mean, 1});
  expect({"stereo, phantom: pixels off by more than 3 %", "%", bad, 3});
  expect({"stereo, phantom: tissue in both views with a depth", "%", dense, 95,
          Figure::Goal::at_least});
}

using Eigen::Vector3d;

// The phantom before a moving laparoscope of 640 × 480: at most 2 mm and 2° from frame to frame.
class Clip {
 public:
  explicit Clip(int frames)
      : frames_(frames),
        drawn_(plain(OrganPhantom(OrganPhantomOptions{}).surface(6))),
        surface_(drawn_) {
    lens_ = {640, 480, 700, 702, 322, 238};
    const double distance = lens_.fx * surface_.radius_mm() / (0.38 * lens_.height);
    first_ = look_at(surface_.center() + distance * Vector3d(0.5, -0.8, 0.3).normalized(),
                     surface_.center(), Vector3d::UnitZ());
  }

  const RegisteredSurface& surface() const { return surface_; }
  const Intrinsics& lens() const { return lens_; }

  RigidTransform camera_from_world(int frame) const {
    constexpr double kPeriod = 60, kStep_mm = 2, kStep_deg = 2;  // frames; at most, a frame
    const double swing = kPeriod / (2 * std::numbers::pi);
    Motion motion;
    for (int axis = 0; axis < 3; ++axis) {
      const double phase = 2 * std::numbers::pi * (frame / kPeriod + axis / 3.0);
      // Three of them, a third of a turn apart, have a slope of √1.5 together.
      const double share =
          (std::sin(phase) - std::sin(2 * std::numbers::pi * axis / 3.0)) / std::sqrt(1.5);
      motion[axis] = swing * kStep_deg * std::numbers::pi / 180 * share;
      motion[3 + axis] = swing * kStep_mm * share;
    }
    return rigid_transform(moved(object_pose(first_, surface_.center()), motion),
                           surface_.center());
  }

  // A lamp beside the lens; a grey shaft crosses the middle third of the clip, and in the middle of
  // that five frames show nothing at all.
  Rgb8Image frame(int number) const {
    LampScene scene;
    scene.light.lamp_camera_mm = {4, 3, 0};
    scene.light.beam_exponent = 2;
    Rgb8Image image =
        develop(picture_of_mesh_by_lamp(drawn_, {"", lens_, camera_from_world(number)}, scene),
                {.noise = 0.01, .seed = static_cast<std::uint64_t>(number)});
    if (is_blind(number)) std::fill(image.pixels.begin(), image.pixels.end(), std::uint8_t{90});
    const double passed = 3.0 * number / frames_ - 1;
    if (passed > 0 && passed < 1) put_shaft(image, passed);
    return image;
  }
  bool is_blind(int number) const { return std::abs(number - frames_ / 2) <= 2; }

 private:
  static TriangleMesh plain(TriangleMesh mesh) {
    mesh.colors.clear();
    return mesh;
  }
  static void put_shaft(Rgb8Image& image, double passed) {
    constexpr double kHalfWidth = 22;  // pixels
    const double middle = passed * image.width;
    for (int y = 0; y < image.height * 2 / 3; ++y)
      for (int x = 0; x < image.width; ++x) {
        const double across = (x - middle - 0.3 * y) / kHalfWidth;
        if (std::abs(across) > 1) continue;
        std::fill_n(image.at(x, y), 3,
                    static_cast<std::uint8_t>(60 + 150 * std::sqrt(1 - across * across)));
      }
  }

  int frames_;
  TriangleMesh drawn_;
  RegisteredSurface surface_;
  Intrinsics lens_;
  RigidTransform first_;
};

TEST(Tracking, FollowsAClipThroughInstrumentsAndBlindFrames) {
  const int frames = cases(60, 200);
  const Clip clip(frames);
  PoseTracker tracker(clip.surface(), clip.lens(), {});
  tracker.start_from(clip.camera_from_world(0));
  std::vector<double> errors_mm;
  int seen = 0, wrong_ok = 0, blind_ok = 0, after_blind = -1;
  for (int i = 0; i < frames; ++i) {
    const Rgb8Image image = clip.frame(i);
    const RegisteredPhoto found = tracker.next(image, {});
    const bool ok = found.quality.verdict == Verdict::ok;
    if (clip.is_blind(i)) {
      blind_ok += ok;
      continue;
    }
    const double mm =
        clip.surface().mean_distance_mm(clip.camera_from_world(i), found.camera.camera_from_world);
    ++seen;
    wrong_ok += ok && mm > 1;
    if (ok) errors_mm.push_back(mm);
    if (ok && i > frames / 2 && after_blind < 0) after_blind = i - frames / 2 - 2;
  }
  const std::string what = "a clip of " + std::to_string(frames) + " frames, 2 mm and 2° a frame";
  expect({what + ": mTRE of ok ones, median", "mm",
          errors_mm.empty() ? 1e9 : spread_of(errors_mm).median, 0.3});
  expect({what + ": ok", "%", 100.0 * static_cast<double>(errors_mm.size()) / seen, 90,
          Figure::Goal::at_least});
  expect({what + ": wrong or blind frames called ok", "", double(wrong_ok + blind_ok), 0});
  expect({what + ": frames after five blind ones until it is found", "",
          after_blind < 0 ? 1e9 : double(after_blind), 10});
}

}  // namespace
}  // namespace organbake
