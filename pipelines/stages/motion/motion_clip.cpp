// SPDX-License-Identifier: GPL-3.0-or-later
// Follows the tissue through a clip, and keeps the pictures that will be views.
#include "stages/motion/motion_clip.h"

#include <set>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/prepared_frame.h"
#include "stages/shared/clip_source.h"

namespace organbake {
namespace {

constexpr std::size_t kAtOnce = 4;     // frames in memory
constexpr std::size_t kLookEvery = 5;  // of so many for what moves slowly

struct Work {
  ClipPicture frame;
  Grid<std::uint8_t> tracked;
  double sharpness = 0, brightness = 0;
};

// Keeps the frames that will be views, and those of which the next one will be chosen.
class LikelyViews {
 public:
  explicit LikelyViews(ClipPictures& pictures) : pictures_(pictures) {}

  void add(const ClipTracks& clip, const std::vector<double>& sharpness, ClipPicture picture) {
    if (too_many_) return;
    const std::size_t frame = clip.frames - 1;
    const bool cut = frame > 0 && clip.shots.back() == frame;
    if (cut) settle(clip, sharpness, frame, true);
    pictures_.keep(frame, std::move(picture));
    if (cut) last_ = frame, ++views_;
    settle(clip, sharpness, clip.frames, false);
  }
  void end(const ClipTracks& clip, const std::vector<double>& sharpness) {
    if (!too_many_) settle(clip, sharpness, clip.frames, true);
  }

 private:
  void settle(const ClipTracks& clip, const std::vector<double>& sharpness, std::size_t end,
              bool over) {
    while (const auto view = next_view(choice_, clip, sharpness, last_, end, over)) {
      pictures_.drop(last_ + 1, *view);
      last_ = *view;
      ++views_;
    }
    // Of so many steps others are taken, or only some of the shots.
    too_many_ = views_ > choice_.most_views;
    if (too_many_) pictures_.drop(0, clip.frames);
  }

  const ViewChoice choice_ = MotionOptions{}.views;
  ClipPictures& pictures_;
  std::size_t last_ = 0, views_ = 1;
  bool too_many_ = false;
};

class Following {
 public:
  Following(ShadeSource source, const RunContext& context, ClipPictures& pictures,
            const Mask& insets)
      : source_(std::move(source)),
        views_(pictures),
        usable_(kLookEvery, insets),
        context_(context) {
    clip_.lens = source_.camera;
    clip_.insets = insets;
  }

  FollowedClip run() {
    ClipDriver<Work>()
        .at_once([](Work& item) {
          item.tracked = tracked_picture(item.frame.picture.color);
          item.sharpness = sharpness(item.frame.picture.color);
          item.brightness = brightness(item.frame.picture.color);
        })
        .in_turn([this](Work& item) { item.frame.usable = usable_.next(item.frame.picture.color); })
        .in_turn([this](Work& item) { follow(item); })
        .run(kAtOnce, [this] { return take(); });
    views_.end(tracker_.clip(), clip_.sharpness);
    clip_.tracks = tracker_.take();
    clip_.stop_center = usable_.stop_center();
    return std::move(clip_);
  }

  Mask found_insets() const { return insets_.find(); }

 private:
  std::shared_ptr<Work> take() {
    context_.throw_if_cancelled();
    auto item = std::make_shared<Work>();
    try {
      if (source_.next(item->frame.picture)) {
        if (frames_taken_++ == 0) refuse_two_eyes(item->frame.picture.color);
        return item;
      }
    } catch (const BadDataError& error) {
      if (clip_.names.empty()) throw;
      clip_.damage = error.what();
    }
    return nullptr;
  }

  static void refuse_two_eyes(const Rgb8Image& first) {
    if (find_stereo_layout(first) == StereoLayout::none) return;
    throw BadDataError(
        "the clip's first frame holds two like pictures, as of a stereo endoscope: no one lens has "
        "seen it. Give it with its calibration to stereo (a recipe's inputs left and calibration), "
        "or cut one eye out");
  }

  void follow(Work& item) {
    constexpr std::size_t kDigits = 6;
    const std::string& name = item.frame.picture.name;
    clip_.names.push_back(name.empty() ? padded(clip_.names.size(), kDigits) : name);
    clip_.sharpness.push_back(item.sharpness);
    clip_.brightness.push_back(item.brightness);
    if (clip_.insets.size() == 0) insets_.add(item.frame.picture.color);
    tracker_.add(item.tracked, item.frame.usable);
    views_.add(tracker_.clip(), clip_.sharpness, std::move(item.frame));
  }

  ShadeSource source_;
  std::size_t frames_taken_ = 0;
  FeatureTracker tracker_;
  LikelyViews views_;
  UsablePixels usable_;
  InsetFinder insets_;
  const RunContext& context_;
  FollowedClip clip_;
};

}  // namespace

FollowedClip follow_clip(const StageCall& call, ClipPictures& pictures) {
  const auto following = [&](const RunContext& told, const Mask& insets) {
    return Following(open_frames(*call.input("frames"), call.input("intrinsics"), told),
                     call.context, pictures, insets);
  };
  Following all = following(call.context, {});
  FollowedClip clip = all.run();
  const Mask insets = all.found_insets();
  if (insets.size() == 0) return clip;
  pictures.begin_beside(insets);
  return following(RunContext(nullptr, nullptr, nullptr), insets).run();  // all has been said
}

void ClipPictures::begin_beside(Mask insets) {
  kept_.clear();
  insets_ = std::move(insets);
}

void ClipPictures::drop(std::size_t first, std::size_t end) {
  kept_.erase(kept_.lower_bound(first), kept_.lower_bound(end));
}

std::vector<const ClipPicture*> ClipPictures::load(const std::vector<std::size_t>& frames) {
  std::set<std::size_t> missing;
  for (const std::size_t frame : frames)
    if (!kept_.contains(frame)) missing.insert(frame);
  if (!missing.empty()) {
    const RunContext quiet(nullptr, nullptr, nullptr);  // all is said the first time
    ShadeSource source = open_frames(*call_.input("frames"), call_.input("intrinsics"), quiet);
    ClipPicture frame;
    for (std::size_t i = 0; i <= *missing.rbegin() && source.next(frame.picture); ++i) {
      call_.context.throw_if_cancelled();
      if (!missing.contains(i)) continue;
      frame.usable = UsablePixels(kLookEvery, insets_).next(frame.picture.color);
      keep(i, std::exchange(frame, {}));
    }
  }
  std::vector<const ClipPicture*> pictures;
  for (const std::size_t frame : frames) {
    const auto found = kept_.find(frame);
    if (found == kept_.end())
      throw BadDataError(*call_.input("frames"), "changed while it was read");
    pictures.push_back(&found->second);
  }
  return pictures;
}

}  // namespace organbake
