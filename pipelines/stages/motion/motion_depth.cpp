// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/motion/motion_depth.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/motion/agreement.h"
#include "organbake/motion/borrow_depth.h"
#include "organbake/motion/held_shading.h"
#include "organbake/motion/neighbours.h"
#include "organbake/motion/plane_sweep.h"

namespace organbake {
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

// What a view can show: all but the outermost places, and some way beyond.
DepthRange range_of(const std::vector<double>& depths) {
  constexpr double kOutermost = 0.01, kNearer = 0.9, kFarther = 1.15;
  const auto at = [&](double share) {
    return depths[static_cast<std::size_t>(share * static_cast<double>(depths.size() - 1))];
  };
  return {kNearer * at(kOutermost), kFarther * at(1 - kOutermost)};
}

// Tissue moves: frames that lie near in time are the likelier to show the same.
constexpr double kUsualGap_views = 6, kUsualGap_keys = 1.5;
constexpr int kMostPartners = 4;

class KeyDepths {
 public:
  KeyDepths(const ClipMotion& motion, const ViewPictures& pictures,
            const MotionStageOptions& options, const RunContext& context)
      : motion_(motion), pictures_(pictures), options_(options), context_(context) {
    for (std::size_t view = 0; view < motion.view_frames.size(); ++view)
      if (motion.scene.is_posed(view)) posed_.push_back(view);
    choose_keys();
  }

  std::vector<KeyView> run() {
    prepare();
    sweep();
    hold_against_each_other();
    fill();
    return std::move(keys_);
  }

 private:
  // Of each part of the way the view that sees most places.
  void choose_keys() {
    const std::size_t count =
        std::min(posed_.size(), static_cast<std::size_t>(options_.key_frames));
    for (std::size_t part = 0; part < count; ++part) {
      const std::size_t first = part * posed_.size() / count;
      const std::size_t end = (part + 1) * posed_.size() / count;
      std::size_t best = first, most = 0;
      for (std::size_t i = first; i < end; ++i)
        if (const std::size_t seen = seen_depths(motion_.scene, posed_[i]).size(); seen > most) {
          most = seen;
          best = i;
        }
      constexpr std::size_t kFewest = 30;
      if (most >= kFewest) chosen_.push_back(best);
    }
    if (chosen_.size() < 2)
      throw BadDataError("fewer than two frames see enough of the tissue to make depth of");
  }

  void prepare() {
    frames_.resize(posed_.size());
    keys_.resize(chosen_.size());
    tbb::parallel_for(std::size_t{0}, posed_.size(), [&](std::size_t i) {
      const std::size_t frame = motion_.view_frames[posed_[i]];
      const auto key = std::find(chosen_.begin(), chosen_.end(), i);
      const FrameOptions prepare{.halvings = options_.halvings,
                                 .piecewise_albedo = key != chosen_.end()};
      PreparedFrame ready = prepare_frame(pictures_.picture(frame), motion_.scene.lens, prepare);
      const RigidTransform& pose = *motion_.scene.camera_from_world[posed_[i]];
      frames_[i] = posed_frame(ready, pose);
      if (key == chosen_.end()) return;
      KeyView& view = keys_[static_cast<std::size_t>(key - chosen_.begin())];
      view.frame = frame;
      view.prepared = std::move(ready);
      view.camera_from_world = pose;
    });
    for (const PosedFrame& frame : frames_) cameras_.push_back(frame.camera);
  }

  void sweep() {
    swept_.resize(chosen_.size());
    std::size_t done = 0;
    for (std::size_t key = 0; key < chosen_.size(); ++key) {
      context_.throw_if_cancelled();
      const std::vector<double> depths = seen_depths(motion_.scene, posed_[chosen_[key]]);
      std::vector<const PosedFrame*> neighbours;
      for (const std::size_t other : best_neighbours(
               cameras_, chosen_[key], depths[depths.size() / 2], {.usual_gap = kUsualGap_views}))
        neighbours.push_back(&frames_[other]);
      if (neighbours.empty()) continue;
      swept_[key] = sweep_depth(frames_[chosen_[key]], neighbours, range_of(depths), {}, context_);
      context_.progress(static_cast<double>(++done) / static_cast<double>(chosen_.size()));
    }
  }

  void hold_against_each_other() {
    drop_keys([&](std::size_t key) { return swept_[key].depth.size() == 0; });
    std::vector<PosedCamera> cameras;
    for (const std::size_t key : chosen_) cameras.push_back(cameras_[key]);
    std::vector<std::vector<std::size_t>> partners;
    for (std::size_t key = 0; key < keys_.size(); ++key) {
      const std::vector<double> depths = seen_depths(motion_.scene, posed_[chosen_[key]]);
      partners.push_back(best_neighbours(
          cameras, key, depths[depths.size() / 2],
          {.most = kMostPartners, .least_angle_rad = 0, .usual_gap = kUsualGap_keys}));
    }
    check_agreement(cameras, partners, swept_);
    borrow_depth(cameras, partners, swept_);
  }

  void fill() {
    std::vector<std::uint8_t> failed(keys_.size(), 0);
    tbb::parallel_for(std::size_t{0}, keys_.size(), [&](std::size_t key) {
      KeyView& view = keys_[key];
      view.swept_share = sure_share(view.prepared, swept_[key]);
      try {
        view.depth = fill_by_shading(view.prepared, swept_[key], {});
        if (!options_.shading) keep_sure_alone(swept_[key], view.depth);
      } catch (const BadDataError&) {
        failed[key] = 1;  // nothing of it is certain
      }
    });
    drop_keys([&](std::size_t key) { return failed[key] != 0; });
    if (keys_.empty()) throw BadDataError("parallax is sure of nothing in any key frame");
  }

  static constexpr float kSure = 0.5F;

  static double sure_share(const PreparedFrame& frame, const SweptDepth& swept) {
    std::size_t sure = 0, field = 0;
    for (std::size_t k = 0; k < frame.field.size(); ++k) {
      field += frame.field.values[k] != 0;
      sure += frame.field.values[k] && swept.confidence.values[k] >= kSure;
    }
    return field ? static_cast<double>(sure) / static_cast<double>(field) : 0;
  }

  static void keep_sure_alone(const SweptDepth& swept, FrameDepth& depth) {
    for (std::size_t k = 0; k < depth.depth.size(); ++k)
      if (swept.confidence.values[k] < kSure)
        depth.depth.values[k] = std::numeric_limits<float>::infinity();
  }

  template <class Drop>
  void drop_keys(const Drop& drop) {
    std::size_t kept = 0;
    for (std::size_t key = 0; key < keys_.size(); ++key) {
      if (drop(key)) continue;
      if (kept != key) {
        keys_[kept] = std::move(keys_[key]);
        swept_[kept] = std::move(swept_[key]);
        chosen_[kept] = chosen_[key];
      }
      ++kept;
    }
    keys_.resize(kept);
    swept_.resize(kept);
    chosen_.resize(kept);
  }

  const ClipMotion& motion_;
  const ViewPictures& pictures_;
  const MotionStageOptions& options_;
  const RunContext& context_;
  std::vector<std::size_t> posed_;   // views
  std::vector<std::size_t> chosen_;  // of posed_, the key frames
  std::vector<PosedFrame> frames_;   // of posed_
  std::vector<PosedCamera> cameras_;
  std::vector<SweptDepth> swept_;  // of the key frames
  std::vector<KeyView> keys_;
};

}  // namespace

std::vector<KeyView> key_depths(const ClipMotion& motion, const ViewPictures& pictures,
                                const MotionStageOptions& options, const RunContext& context) {
  return KeyDepths(motion, pictures, options, context).run();
}

}  // namespace organbake
