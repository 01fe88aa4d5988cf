// SPDX-License-Identifier: GPL-3.0-or-later
//
// How the scope moved through a clip. In: the tracks of its features, the frames' sharpness, a lens
// or a guess of it. The frames that are solved for are chosen by how far features have moved; the
// views of each shot become a scene (reconstruction.cpp), the longest one is kept, and the frames
// between are posed from its places. Out: poses, points, the lens with its spread, and what was
// left out and why.
#include "organbake/motion/clip_motion.h"

#include <algorithm>
#include <deque>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "two_views.h"

namespace organbake {
namespace {

// The sharpest of the second half of the way from the last view.
std::size_t sharpest_of(const std::vector<double>& sharpness, std::size_t last, std::size_t now) {
  const std::size_t middle = last + 1 + (now - last) / 2;
  std::size_t best = now;
  for (std::size_t frame = middle; frame < now; ++frame)
    if (sharpness[frame] > sharpness[best]) best = frame;
  return best;
}

}  // namespace

std::optional<std::size_t> next_view(const ViewChoice& choice, const ClipTracks& clip,
                                     const std::vector<double>& sharpness, std::size_t last,
                                     std::size_t end, bool over) {
  const double motion_px = choice.motion_share * clip.width;
  for (std::size_t frame = last + 1; frame < end; ++frame)
    if (frame - last >= choice.most_apart || (over && frame + 1 == end) ||
        motion_between(clip, last, frame).median_px >= motion_px)
      return sharpest_of(sharpness, last, frame);
  return std::nullopt;
}

std::vector<std::size_t> choose_views(const ViewChoice& choice, const ClipTracks& clip,
                                      const std::vector<double>& sharpness, std::size_t first,
                                      std::size_t end) {
  if (first >= end) return {};
  ViewChoice steps = choice;
  while (true) {
    std::vector<std::size_t> views = {first};
    while (const auto view = next_view(steps, clip, sharpness, views.back(), end, true))
      views.push_back(*view);
    if (views.size() <= choice.most_views) return views;
    steps.motion_share *= 1.3;
    steps.most_apart += steps.most_apart / 3 + 1;
  }
}

namespace {

constexpr std::size_t kEnoughFeatures = 300;  // features hold a pose as well as thousands
constexpr std::size_t kFewestFeatures = 15;

SeenPlaces seen_in(const ClipTracks& clip, const Scene& scene, double breath, std::size_t frame) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i)
    if (scene.landmarks[i].place && clip.tracks[scene.landmarks[i].track].is_in(frame))
      all.push_back(i);
  const std::size_t step = std::max<std::size_t>(1, all.size() / kEnoughFeatures);
  SeenPlaces seen;
  for (std::size_t i = 0; i < all.size(); i += step) {
    const Landmark& landmark = scene.landmarks[all[i]];
    seen.places.push_back(*landmark.place + breath * landmark.push);
    seen.pixels.push_back(clip.tracks[landmark.track].at(frame).cast<double>());
  }
  return seen;
}

// The poses of all frames between the first and the last posed view, each from the places that its
// features have, started from the nearest view. Nothing where too few of them agree.
std::vector<std::optional<RigidTransform>> pose_frames(const ClipTracks& clip,
                                                       const ClipMotion& motion) {
  const Scene& scene = motion.scene;
  const std::vector<std::size_t>& view_frames = motion.view_frames;
  std::vector<std::optional<RigidTransform>> poses(clip.frames);
  const std::vector<std::size_t> posed = scene.posed();
  if (posed.empty()) return poses;
  // Features reach some frames beyond the outermost views.
  constexpr std::size_t kBeyond = 10;
  const std::size_t first = view_frames[posed.front()], last = view_frames[posed.back()];
  // But not as far as a view that the scene does not explain.
  const std::size_t before = posed.front() > 0 ? view_frames[posed.front() - 1] + 1 : 0;
  const std::size_t after =
      posed.back() + 1 < view_frames.size() ? view_frames[posed.back() + 1] : clip.frames;
  const std::size_t begin = std::max(before, first - std::min(first, kBeyond));
  parallel_for(begin, std::min(after, last + 1 + kBeyond), [&](std::size_t frame) {
    const auto distance = [&](std::size_t view) {
      return view_frames[view] > frame ? view_frames[view] - frame : frame - view_frames[view];
    };
    const std::size_t nearest =
        *std::min_element(posed.begin(), posed.end(),
                          [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
    RigidTransform pose = *scene.camera_from_world[nearest];
    if (view_frames[nearest] != frame) {
      const double time = breath_time(view_frames, frame);
      const SeenPlaces seen =
          seen_in(clip, scene, motion.breath ? motion.breath->course(time) : 0, frame);
      const std::size_t agreeing = adjust_pose(scene.lens, seen, pose);
      if (agreeing < kFewestFeatures || 2 * agreeing < seen.places.size()) return;
    }
    poses[frame] = pose;
  });
  return poses;
}

constexpr double kSureAngle_rad = 0.0349;  // 2 degrees
constexpr std::size_t kSureViews = 3, kFewestViews = 5;

using Frames = std::vector<std::size_t>;

void measure(ClipMotion& motion) {
  std::vector<double> angles;
  double errors = 0, sightings = 0;
  for (const Landmark& landmark : motion.scene.landmarks) {
    if (!landmark.place) continue;
    const double angle = motion.scene.angle_rad(landmark);
    angles.push_back(angle);
    double own = 0;
    std::size_t agreeing = 0;
    for (const Sighting& sighting : landmark.seen) {
      if (!sighting.agrees || !motion.scene.is_posed(sighting.view)) continue;
      own += motion.scene.error_px(landmark, sighting);
      ++agreeing;
    }
    if (agreeing < kSureViews || angle < kSureAngle_rad) continue;
    ++motion.points;
    errors += own;
    sightings += static_cast<double>(agreeing);
  }
  motion.median_angle_rad = median(std::move(angles));
  if (motion.points == 0) return;
  motion.mean_error_px = errors / sightings;
}

// The verdict; a failure, where the lamp says that all is inside out.
void judge(double runner_up, bool lens_is_free, ClipMotion& motion) {
  motion.quality = judge_motion(motion, lamp_agreement(motion.scene), runner_up, lens_is_free);
  if (motion.failure.empty() && motion.quality.verdict == DepthVerdict::failed)
    motion.failure = motion.quality.reason;
}

const std::string kSmaller = "another span is longer",
                  kNotRigid =
                      "no one rigid scene with the longest span: there the scope jumps, or "
                      "tissue moves";

class MotionSearch {
 public:
  MotionSearch(const MotionOptions& options, const ClipTracks& clip, const Intrinsics& lens,
               const PictureLoader& load, const RunContext& context)
      : options_(options), clip_(clip), lens_(lens), load_(load), context_(context) {}

  // Frames, and why they are left out where another span is longer.
  struct Candidate {
    Frames frames;
    std::string smaller = kSmaller;
  };

  // Tries the views of each shot, then what their first scene left over; the best is kept.
  ClipMotion best_of(std::deque<Candidate> shots) {
    ClipMotion best;
    const std::string fewest = std::to_string(kFewestViews);
    best.failure = clip_.frames < kFewestViews
                       ? "the clip is too short: it has " + std::to_string(clip_.frames) +
                             (clip_.frames == 1 ? " frame" : " frames") + ", and at least " +
                             fewest + " are needed"
                       : "no shot of the clip has " + fewest + " frames that differ";
    while (!shots.empty()) {
      const auto [frames, smaller] = std::move(shots.front());
      shots.pop_front();
      if (frames.size() < kFewestViews) {
        // One frame neither moves nor stands still.
        const std::string still = frames.size() > 1 ? without_motion(frames) : "";
        leave_out(frames, still.empty() ? "too short" : still);
        if (!still.empty() && clip_.frames >= kFewestViews && best.scene.posed_views() == 0)
          best.failure = still;
        continue;
      }
      if (best.scene.posed_views() >= frames.size()) {
        leave_out(frames, smaller);
        continue;
      }
      ClipMotion found = solve(frames);
      if (!found.failure.empty()) {
        leave_out(frames, found.failure);
        if (best.scene.posed_views() == 0) best = std::move(found);
        continue;
      }
      // What one scene leaves over may hold a longer one.
      for (Frames& rest : unposed_runs(found)) shots.push_back({std::move(rest), kNotRigid});
      const bool better = found.scene.posed_views() > best.scene.posed_views();
      if (better) std::swap(best, found);
      if (found.scene.posed_views() > 0) leave_out(found.view_frames, smaller);
    }
    best.left_out = std::move(left_out_);
    if (best.scene.posed_views() > 0) widen_to_poses(best);
    return best;
  }

 private:
  void leave_out(const Frames& frames, std::string reason) {
    if (!frames.empty()) left_out_.push_back({frames.front(), frames.back(), std::move(reason)});
  }

  // What lies between frames with a pose and those that are left out has none, either.
  static void widen_to_poses(ClipMotion& motion) {
    const auto untold = [&](std::size_t frame) {
      return frame < motion.camera_from_world.size() && !motion.camera_from_world[frame] &&
             std::ranges::none_of(motion.left_out, [frame](const FrameSpan& span) {
               return span.first <= frame && frame <= span.last;
             });
    };
    for (FrameSpan& span : motion.left_out) {
      while (untold(span.first - 1)) --span.first;
      while (untold(span.last + 1)) ++span.last;
    }
  }

  // Runs of views that the scene does not explain. Those beside one that it does explain are left
  // out: they may be as moved as it is, and would pass for the begin of another scene.
  static std::vector<Frames> unposed_runs(const ClipMotion& motion) {
    std::vector<Frames> runs(1);
    const std::size_t count = motion.view_frames.size();
    const auto is_posed = [&](std::size_t view) {
      return view < count && motion.scene.is_posed(view);
    };
    for (std::size_t view = 0; view < count; ++view) {
      if (!is_posed(view) && !is_posed(view - 1) && !is_posed(view + 1))
        runs.back().push_back(motion.view_frames[view]);
      else if (!runs.back().empty())
        runs.emplace_back();
    }
    if (runs.back().empty()) runs.pop_back();
    return runs;
  }

  // How far features move at most from one of the frames to another; nothing where no two frames
  // share enough of them to tell.
  std::optional<double> farthest_px(const Frames& frames) const {
    constexpr std::size_t kFewest = 20;
    std::optional<double> farthest;
    for (std::size_t i = 1; i < frames.size(); ++i)
      for (const std::size_t other : {frames.front(), frames[i / 2], frames[i - 1]}) {
        const TrackedMotion moved = motion_between(clip_, other, frames[i]);
        if (moved.features >= kFewest) farthest = std::max(farthest.value_or(0), moved.median_px);
      }
    return farthest;
  }

  // Why frames tell nothing though there are enough of them; empty where features move.
  std::string without_motion(const Frames& frames) const {
    constexpr double kLeastMotion_px = 4;
    const std::optional<double> farthest = farthest_px(frames);
    if (!farthest)
      return "no two frames share enough features: what is seen is lost from one frame to the next "
             "(too fast, blurred, dark or without texture)";
    if (*farthest >= kLeastMotion_px) return "";
    return "the scope stands still: features move by " + to_text(*farthest, 1) + " pixels at most";
  }

  ClipMotion solve(const Frames& frames) {
    ClipMotion motion;
    motion.view_frames = frames;
    motion.scene.lens = lens_;
    motion.failure = without_motion(frames);
    if (!motion.failure.empty()) return motion;
    motion.scene.landmarks = landmarks_of(clip_, frames);
    motion.scene.camera_from_world.resize(frames.size());
    // Read once, for all that is asked of them.
    const std::vector<const ClipPicture*> pictures = load_(frames);
    measure_light(pictures, motion.scene);
    // A few views first, from several lenses: whichever basin they fall into, all others follow.
    const BasinChoice basin = choose_basin(options_.lens, motion.scene, context_);
    motion.failure = reconstruct(options_.lens, motion.scene, context_);
    if (motion.failure.empty()) finish(basin, pictures, motion);
    return motion;
  }

  void finish(const BasinChoice& basin, const std::vector<const ClipPicture*>& pictures,
              ClipMotion& motion) {
    constexpr double kLeastAngle_rad = 0.017;  // between the rays to a place: less tells no depth
    const FreeLens& free = options_.lens;
    if (motion.scene.posed_views() > kSureViews) {
      rejoin(pictures, motion.scene);
      measure_light(pictures, motion.scene);
      drop_outliers(motion.scene);
    }
    adjust({.lens = free}, motion.scene);
    drop_outliers(motion.scene);
    // A breath may part the clip: of one part alone it is not told.
    motion.breath_period_frames = breath_period_frames(motion.view_frames, motion.scene);
    if (motion.breath_period_frames > 0)
      motion.breath =
          solve_breath(free, motion.breath_period_frames, motion.view_frames, motion.scene);
    if (motion.breath) motion.breath_period_frames = motion.breath->period_frames;
    keep_rigid_span(free, motion.scene);
    if (free.focal) {
      // What agrees was told anew, and a lens goes a long way for little.
      adjust({.lens = free, .tolerance = 1e-6}, motion.scene);
      drop_outliers(motion.scene);
    }
    measure(motion);
    if (motion.scene.posed_views() < kFewestViews)
      motion.failure = "only " + std::to_string(motion.scene.posed_views()) +
                       " frames agree about one rigid scene";
    else if (motion.median_angle_rad < kLeastAngle_rad)
      motion.failure = "the scope hardly moves sideways: its rays to the tissue stand " +
                       to_text(motion.median_angle_rad * 57.29577951308232, 1) + " degrees apart";
    if (!motion.failure.empty()) return;
    motion.lens_spread = lens_spread(free, motion.scene, basin.focal_variance_px2);
    motion.camera_from_world = pose_frames(clip_, motion);
    judge(basin.runner_up, free.focal, motion);
  }

  const MotionOptions& options_;
  const ClipTracks& clip_;
  const Intrinsics& lens_;
  const PictureLoader& load_;
  const RunContext& context_;
  std::vector<FrameSpan> left_out_;
};

}  // namespace

ClipMotion find_motion(const MotionOptions& options, const ClipTracks& clip,
                       const std::vector<double>& sharpness, const Intrinsics& lens,
                       const PictureLoader& load, const RunContext& context) {
  if (clip.tracks.empty()) {
    ClipMotion nothing;
    nothing.failure =
        "nothing can be followed: the frames are black, or instruments and highlights cover them";
    return nothing;
  }
  std::deque<MotionSearch::Candidate> shots;
  for (std::size_t i = 0; i < clip.shots.size(); ++i) {
    const std::size_t end = i + 1 < clip.shots.size() ? clip.shots[i + 1] : clip.frames;
    shots.push_back({choose_views(options.views, clip, sharpness, clip.shots[i], end)});
  }
  std::stable_sort(shots.begin(), shots.end(),
                   [](const auto& a, const auto& b) { return a.frames.size() > b.frames.size(); });
  return MotionSearch(options, clip, lens, load, context).best_of(std::move(shots));
}

ClipMotion motion_of_poses(const MotionOptions& options, const ClipTracks& clip,
                           const Intrinsics& lens,
                           std::vector<std::optional<RigidTransform>> camera_from_world,
                           const PictureLoader& load) {
  ClipMotion motion;
  motion.scene.lens = lens;
  std::vector<std::size_t> posed;
  for (std::size_t frame = 0; frame < camera_from_world.size(); ++frame)
    if (camera_from_world[frame]) posed.push_back(frame);
  const std::size_t step = posed.size() / (options.views.most_views + 1) + 1;
  for (std::size_t i = 0; i < posed.size(); i += step) {
    motion.view_frames.push_back(posed[i]);
    motion.scene.camera_from_world.push_back(camera_from_world[posed[i]]);
  }
  motion.scene.landmarks = landmarks_of(clip, motion.view_frames);
  measure_light(load(motion.view_frames), motion.scene);
  triangulate(motion.scene);
  motion.breath_period_frames = breath_period_frames(motion.view_frames, motion.scene);
  measure(motion);
  motion.camera_from_world = std::move(camera_from_world);
  const double explained = agreeing_share(motion.scene);
  constexpr double kFew = 0.3;  // poses found by other programs explain two thirds and more
  if (explained < kFew)
    motion.failure = "the given poses explain only " + percent(explained) +
                     " of what was followed: are they of this clip and lens?";
  judge(0, false, motion);
  return motion;
}

}  // namespace organbake
