// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/motion/motion_clip.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>

#include <set>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/motion/tracked_picture.h"
#include "organbake/motion/usable_pixels.h"
#include "organbake/shading/frame_preparation.h"
#include "stages/shared/clip_source.h"

namespace organbake {
namespace {

constexpr std::size_t kAtOnce = 4;  // frames in memory

struct Work {
  StoredPicture frame;
  Grid<std::uint8_t> picture;
  Mask usable;
  double sharpness = 0;
};
using Item = std::shared_ptr<Work>;

class Following {
 public:
  Following(ShadeSource source, const MotionStageOptions& options, const RunContext& context)
      : source_(std::move(source)), tracker_(options.tracking), context_(context) {
    clip_.lens = source_.camera;
  }

  FollowedClip run() {
    using tbb::filter_mode;
    tbb::parallel_pipeline(
        kAtOnce,
        tbb::make_filter<void, Item>(filter_mode::serial_in_order, [this](tbb::flow_control& flow) {
          return take(flow);
        }) & tbb::make_filter<Item, Item>(filter_mode::parallel, [](Item item) {
          return prepare(std::move(item));
        }) & tbb::make_filter<Item, Item>(filter_mode::serial_in_order, [this](Item item) {
          return mask(std::move(item));
        }) & tbb::make_filter<Item, void>(filter_mode::serial_in_order, [this](Item item) {
          follow(*item);
        }));
    clip_.tracks = tracker_.take();
    clip_.instrument_share = usable_.instrument_share();
    return std::move(clip_);
  }

 private:
  Item take(tbb::flow_control& flow) {
    context_.throw_if_cancelled();
    auto item = std::make_shared<Work>();
    try {
      if (source_.next(item->frame)) return item;
    } catch (const BadDataError& error) {
      if (clip_.names.empty()) throw;
      clip_.damage = error.what();
    }
    flow.stop();
    return nullptr;
  }

  static Item prepare(Item item) {
    item->picture = tracked_picture(item->frame.color);
    item->sharpness = sharpness(item->frame.color);
    return item;
  }

  Item mask(Item item) {
    item->usable = usable_.next(item->frame.color);
    return item;
  }

  void follow(const Work& item) {
    constexpr std::size_t kDigits = 6;
    tracker_.add(item.picture, item.usable);
    clip_.sharpness.push_back(item.sharpness);
    clip_.names.push_back(item.frame.name.empty() ? padded(clip_.names.size(), kDigits)
                                                  : item.frame.name);
  }

  ShadeSource source_;
  FeatureTracker tracker_;
  UsablePixels usable_;
  const RunContext& context_;
  FollowedClip clip_;
};

}  // namespace

FollowedClip follow_clip(const StageCall& call, const MotionStageOptions& options) {
  return Following(open_frames(*call.input("frames"), call.input("intrinsics"), call.context),
                   options, call.context)
      .run();
}

void ViewPictures::read(const std::vector<std::size_t>& frames) {
  std::set<std::size_t> wanted;
  for (const std::size_t frame : frames)
    if (!pictures_.contains(frame)) wanted.insert(frame);
  if (wanted.empty()) return;
  const RunContext quiet(nullptr, nullptr, nullptr);  // all is said the first time
  ShadeSource source = open_frames(*call_.input("frames"), call_.input("intrinsics"), quiet);
  StoredPicture picture;
  for (std::size_t frame = 0; frame <= *wanted.rbegin(); ++frame) {
    call_.context.throw_if_cancelled();
    if (!source.next(picture)) break;
    if (wanted.contains(frame)) pictures_[frame] = std::exchange(picture, {});
  }
}

std::vector<TrackedView> ViewPictures::tracked(const std::vector<std::size_t>& frames) {
  read(frames);
  std::vector<TrackedView> views(frames.size());
  tbb::parallel_for(std::size_t{0}, frames.size(), [&](std::size_t i) {
    const Rgb8Image& color = pictures_.at(frames[i]).color;
    views[i] = {tracked_picture(color), UsablePixels().next(color)};
  });
  return views;
}

}  // namespace organbake
