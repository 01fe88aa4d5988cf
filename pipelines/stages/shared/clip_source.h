// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A clip's frames as they are shaded, and the lens that belongs to their pixels.
struct ShadeSource {
  FrameSelection::NextFrame next;
  std::optional<Intrinsics> camera;  // nothing = none is given
};

// A frame (PNG, JPEG, EXR), a folder of frames or a video; `lens` as read_intrinsics() takes it, or
// null. Frames come with square pixels and upright as their files ask, unless the lens is of the
// pixels as they are stored (told by its size, else by its fx : fy). What is done so is said.
// Throws NoInputError, BadDataError.
ShadeSource open_frames(const std::filesystem::path& frames, const std::filesystem::path* lens,
                        const RunContext& context);

// A step that each frame goes through; in_turn: frame after frame, in their order.
struct ClipStep {
  bool in_turn;
  std::function<void(void* frame)> work;
};
void drive_clip(std::size_t in_memory, const std::function<std::shared_ptr<void>()>& take,
                const std::vector<ClipStep>& steps);

// Takes the frames of a clip one after another through steps, a few of them in memory. Steps
// `in_turn` see one frame after another; those `at_once` see several at the same time and know none
// but its own: so what comes of a frame does not depend on how many threads there are.
template <class Frame>
class ClipDriver {
 public:
  ClipDriver& at_once(std::function<void(Frame&)> work) { return add(false, std::move(work)); }
  ClipDriver& in_turn(std::function<void(Frame&)> work) { return add(true, std::move(work)); }

  // take: the next frame; nothing at the end. Throws what it and the steps throw.
  void run(std::size_t in_memory, const std::function<std::shared_ptr<Frame>()>& take) const {
    drive_clip(in_memory, take, steps_);
  }

 private:
  ClipDriver& add(bool in_turn, std::function<void(Frame&)> work) {
    steps_.push_back(
        {in_turn, [work = std::move(work)](void* frame) { work(*static_cast<Frame*>(frame)); }});
    return *this;
  }

  std::vector<ClipStep> steps_;
};

// The next of the frames that a stage takes, as its `selected`; nothing behind the last.
template <class Frame>
std::shared_ptr<Frame> take_selected(FrameSelection& frames, const RunContext& context) {
  context.throw_if_cancelled();
  std::optional<SelectedFrame> next = frames.next();
  if (!next) return nullptr;
  auto taken = std::make_shared<Frame>();
  taken->selected = std::move(*next);
  return taken;
}

// What a recorder has laid into a clip's frames (InsetFinder), by reading up to two thousand of
// them beforehand, up to a damaged one; of no size where there is nothing.
Mask insets_of(const FrameSelection::NextFrame& next, const RunContext& context);
// The same of frames as open_frames() gives them.
Mask insets_of(const std::filesystem::path& frames, const std::filesystem::path* lens,
               const RunContext& context);

}  // namespace organbake
