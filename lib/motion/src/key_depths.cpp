// SPDX-License-Identifier: GPL-3.0-or-later
//
// Depth of a clip's key frames. In: the clip's motion and its pictures. Each key frame is swept on
// its own (plane_sweep.cpp) against the frames that see it from the best angles. What one frame is
// wrong about another sees from elsewhere, so that they are held against each other, and shading
// fills the rest (held_shading.cpp). Tissue moves meanwhile: frames near in time are asked first.
#include "organbake/motion/key_depths.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "view_depths.h"

namespace organbake {
namespace {

struct Candidate {
  std::size_t index = 0;
  double score = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
};

struct Overlap {
  double share = 0, angle_rad = 0;
};

Overlap overlap_of(const PosedCamera& reference, const PosedCamera& other, double depth) {
  constexpr int kGrid = 7;
  const Intrinsics& lens = reference.intrinsics;
  const RigidTransform world = reference.camera_from_world.inverse();
  const Eigen::Vector3d there = other.center_world_mm();
  int seen = 0;
  Overlap overlap;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const Eigen::Vector2d pixel((i % kGrid + 0.5) / kGrid * lens.width,
                                (i / kGrid + 0.5) / kGrid * lens.height);
    const Eigen::Vector3d point = world * Eigen::Vector3d(unproject(lens, pixel) * depth);
    if ((other.camera_from_world * point).z() <= 0) continue;
    const Eigen::Vector2d at = project(other, point);
    if (!(at.x() > 0 && at.y() > 0 && at.x() < other.intrinsics.width &&
          at.y() < other.intrinsics.height))
      continue;
    ++seen;
    const Eigen::Vector3d a = world.translation - point, b = there - point;
    overlap.angle_rad += std::atan2(a.cross(b).norm(), a.dot(b));
  }
  overlap.angle_rad /= std::max(1, seen);
  overlap.share = seen / double(kGrid * kGrid);
  return overlap;
}

constexpr double kBestAngle_rad = 0.08;  // between the rays to one point

// Rises to the best angle and falls slowly beyond it.
double worth(double angle_rad) {
  const double x = angle_rad / kBestAngle_rad;
  return x < 1 ? x : 1 / x;
}

double nearness(std::size_t i, std::size_t reference, double usual_gap) {
  const double gap = (double(i) - double(reference)) / usual_gap;
  return 1 / (1 + gap * gap);
}

}  // namespace

std::vector<std::size_t> best_neighbours(const std::vector<PosedCamera>& cameras,
                                         std::size_t reference, double depth,
                                         const NeighbourOptions& options) {
  constexpr double kMostAngle_rad = 0.6;  // beyond, pictures are unlike
  constexpr double kLeastOverlap = 0.5;   // share of the reference's picture that the other shows
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (i == reference) continue;
    const Overlap overlap = overlap_of(cameras[reference], cameras[i], depth);
    if (overlap.share < kLeastOverlap || overlap.angle_rad < options.least_angle_rad ||
        overlap.angle_rad > kMostAngle_rad)
      continue;
    double score = overlap.share * worth(overlap.angle_rad);
    if (options.usual_gap > 0) score *= nearness(i, reference, options.usual_gap);
    candidates.push_back({i, score, cameras[i].center_world_mm()});
  }
  std::vector<std::size_t> chosen;
  std::vector<Eigen::Vector3d> centers = {cameras[reference].center_world_mm()};
  while (static_cast<int>(chosen.size()) < options.most && !candidates.empty()) {
    // One beside another that is chosen tells little anew.
    const auto gain = [&](const Candidate& candidate) {
      double apart = depth * kBestAngle_rad;
      for (std::size_t i = 1; i < centers.size(); ++i)
        apart = std::min(apart, (candidate.center - centers[i]).norm());
      constexpr double kAlone = 0.25;
      return candidate.score * (kAlone + apart / (depth * kBestAngle_rad));
    };
    const auto best =
        std::max_element(candidates.begin(), candidates.end(),
                         [&](const Candidate& a, const Candidate& b) { return gain(a) < gain(b); });
    chosen.push_back(best->index);
    centers.push_back(best->center);
    candidates.erase(best);
  }
  return chosen;
}

namespace {

// Depths of the places that one view sees, in ascending order.
std::vector<double> seen_depths(const Scene& scene, std::size_t view) {
  std::vector<double> depths;
  for (const Landmark& landmark : scene.landmarks) {
    if (!landmark.place) continue;
    const Sighting* sighting = sighting_in(landmark, view);
    if (sighting && sighting->agrees)
      depths.push_back((*scene.camera_from_world[view] * *landmark.place).z());
  }
  std::sort(depths.begin(), depths.end());
  return depths;
}

// What a view can show: all but the outermost places, and some way beyond. What is nearest is
// smooth lobes' bellies, which hold few features: much of it lies before the first of those.
DepthRange range_of(const std::vector<double>& depths) {
  constexpr double kOutermost = 0.01, kNearer = 0.65, kFarther = 1.15;
  const auto at = [&](double share) {
    return depths[static_cast<std::size_t>(share * static_cast<double>(depths.size() - 1))];
  };
  return {kNearer * at(kOutermost), kFarther * at(1 - kOutermost)};
}

// Tissue moves: frames that lie near in time are the likelier to show the same.
constexpr double kUsualGap_views = 6, kUsualGap_keys = 1.5;
constexpr int kMostPartners = 4;
constexpr float kSureMatch = 0.5F;  // confidence of parallax

// A key frame while it is worked on.
struct Key {
  std::size_t view = 0;
  std::vector<double> depths;           // seen_depths
  std::vector<std::size_t> neighbours;  // views
  SweptDepth swept;
  KeyDepth result;
};

class KeyDepths {
 public:
  KeyDepths(const KeyDepthOptions& options, const ClipMotion& motion, const PictureLoader& load,
            const RunContext& context)
      : options_(options), motion_(motion), load_(load), context_(context) {}

  std::vector<KeyDepth> run() {
    choose_keys();
    choose_neighbours();
    prepare();
    // Each by itself, so that what two of them agree about is told twice.
    sweep();
    hold_against_each_other();
    // Brightness comes last, and only where parallax has left a hole.
    fill();
    std::vector<KeyDepth> results;
    for (Key& key : keys_) results.push_back(std::move(key.result));
    return results;
  }

 private:
  const RigidTransform& pose(std::size_t view) const {
    return *motion_.scene.camera_from_world[view];
  }

  // Of each part of the way the view that sees most places; where tissue breathes, of its rest.
  void choose_keys() {
    constexpr double kAtRest = 0.1;  // of a breath
    const std::vector<double>& breath = motion_.scene.breath;
    for (const std::size_t view : motion_.scene.posed())
      if (breath.empty() || std::abs(breath[view]) <= kAtRest) posed_.push_back(view);
    const std::size_t count =
        std::min(posed_.size(), static_cast<std::size_t>(options_.key_frames));
    for (std::size_t part = 0; part < count; ++part) {
      Key best;
      for (std::size_t i = part * posed_.size() / count; i < (part + 1) * posed_.size() / count;
           ++i)
        if (auto depths = seen_depths(motion_.scene, posed_[i]);
            depths.size() > best.depths.size()) {
          best.view = posed_[i];
          best.depths = std::move(depths);
        }
      constexpr std::size_t kFewest = 30;
      if (best.depths.size() >= kFewest) keys_.push_back(std::move(best));
    }
    demand_two("see enough of the tissue to make depth of");
  }

  void demand_two(const char* what) const {
    if (keys_.size() < 2) throw BadDataError(std::string("fewer than two frames ") + what);
  }

  void choose_neighbours() {
    std::vector<PosedCamera> cameras;
    for (const std::size_t view : posed_) cameras.push_back({"", motion_.scene.lens, pose(view)});
    parallel_for(std::size_t{0}, keys_.size(), [&](std::size_t i) {
      Key& key = keys_[i];
      const auto at = static_cast<std::size_t>(
          std::lower_bound(posed_.begin(), posed_.end(), key.view) - posed_.begin());
      for (const std::size_t other :
           best_neighbours(cameras, at, middle_of(key), {.usual_gap = kUsualGap_views}))
        key.neighbours.push_back(posed_[other]);
    });
    std::erase_if(keys_, [](const Key& key) { return key.neighbours.empty(); });
    demand_two("are seen from the side by others");
  }

  static double middle_of(const Key& key) { return key.depths[key.depths.size() / 2]; }

  // The key frames with all that shading needs, their neighbours as they are matched.
  void prepare() {
    std::set<std::size_t> wanted;
    for (const Key& key : keys_) {
      wanted.insert(key.view);
      wanted.insert(key.neighbours.begin(), key.neighbours.end());
    }
    const std::vector<std::size_t> views(wanted.begin(), wanted.end());
    std::vector<std::size_t> frames;
    for (const std::size_t view : views) frames.push_back(motion_.view_frames[view]);
    const std::vector<const ClipPicture*> pictures = load_(frames);
    for (const std::size_t view : views) frames_[view] = {};
    parallel_for(std::size_t{0}, views.size(), [&](std::size_t i) {
      frames_.at(views[i]) =
          posed_frame(*pictures[i], motion_.scene.lens, options_.halvings, pose(views[i]));
    });
    parallel_for(std::size_t{0}, keys_.size(), [&](std::size_t i) {
      KeyDepth& key = keys_[i].result;
      const auto at = std::lower_bound(views.begin(), views.end(), keys_[i].view) - views.begin();
      key.frame = motion_.view_frames[keys_[i].view];
      key.camera_from_world = pose(keys_[i].view);
      key.prepared =
          prepare_frame(pictures[static_cast<std::size_t>(at)]->picture, motion_.scene.lens,
                        {.halvings = options_.halvings},
                        {.insets = options_.insets.size() > 0 ? &options_.insets : nullptr});
    });
  }

  void sweep() {
    std::atomic<std::size_t> done = 0;
    parallel_for(std::size_t{0}, keys_.size(), [&](std::size_t i) {
      context_.throw_if_cancelled();
      Key& key = keys_[i];
      std::vector<const PosedFrame*> neighbours;
      for (const std::size_t view : key.neighbours) neighbours.push_back(&frames_.at(view));
      key.swept = sweep_depth(frames_.at(key.view), neighbours, range_of(key.depths), context_);
      context_.progress(static_cast<double>(++done) / static_cast<double>(keys_.size()));
    });
  }

  void hold_against_each_other() {
    std::vector<PosedCamera> cameras;
    std::vector<SweptDepth> swept;
    for (Key& key : keys_) {
      cameras.push_back(frames_.at(key.view).camera);
      swept.push_back(std::move(key.swept));
    }
    frames_.clear();
    std::vector<std::vector<std::size_t>> partners;
    for (std::size_t i = 0; i < keys_.size(); ++i)
      partners.push_back(best_neighbours(
          cameras, i, middle_of(keys_[i]),
          {.most = kMostPartners, .least_angle_rad = 0, .usual_gap = kUsualGap_keys}));
    check_agreement(cameras, partners, swept);
    borrow_depth(cameras, partners, swept);
    for (std::size_t i = 0; i < keys_.size(); ++i) keys_[i].swept = std::move(swept[i]);
  }

  void fill() {
    std::vector<std::uint8_t> filled(keys_.size(), 0);
    parallel_for(std::size_t{0}, keys_.size(), [&](std::size_t i) {
      KeyDepth& key = keys_[i].result;
      const SweptDepth& swept = keys_[i].swept;
      try {
        key.depth = fill_by_shading(key.prepared, swept);
      } catch (const BadDataError&) {
        return;  // nothing of it is certain
      }
      filled[i] = 1;
      if (!options_.shading) keep_sure_alone(swept, key.depth);
    });
    std::size_t at = 0;
    std::erase_if(keys_, [&](const Key&) { return filled[at++] == 0; });
    if (keys_.empty()) throw BadDataError("parallax is sure of nothing in any key frame");
  }

  static void keep_sure_alone(const SweptDepth& swept, FrameDepth& depth) {
    for (std::size_t k = 0; k < depth.depth.size(); ++k)
      if (swept.confidence.values[k] < kSureMatch)
        depth.depth.values[k] = std::numeric_limits<float>::infinity();
  }

  const KeyDepthOptions& options_;
  const ClipMotion& motion_;
  const PictureLoader& load_;
  const RunContext& context_;
  std::vector<std::size_t> posed_;  // views
  std::vector<Key> keys_;
  std::map<std::size_t, PosedFrame> frames_;  // by their views
};

}  // namespace

std::vector<KeyDepth> key_depths(const KeyDepthOptions& options, const ClipMotion& motion,
                                 const PictureLoader& load, const RunContext& context) {
  return KeyDepths(options, motion, load, context).run();
}

}  // namespace organbake
