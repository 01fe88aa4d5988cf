// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/shade/shade_clip.h"

#include <tbb/parallel_pipeline.h>

#include <filesystem>

#include "organbake/shading/pictures.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kAtOnce = 4;  // frames in memory
constexpr double kAlike = 12;       // mean difference, of 255, up to which a start is taken over

// One frame on its way through.
struct Work {
  SelectedFrame selected;
  PreparedFrame frame;
  std::shared_ptr<const FrameDepth> depth;
};
using Item = std::shared_ptr<Work>;

class Pipeline {
 public:
  Pipeline(Clip& clip, const ShadeStageOptions& options, const fs::path& folder,
           const RunContext& context)
      : clip_(clip), options_(options), folder_(folder), context_(context) {}

  ClipResult run() {
    using tbb::filter_mode;
    tbb::parallel_pipeline(
        kAtOnce,
        tbb::make_filter<void, Item>(filter_mode::serial_in_order, [this](tbb::flow_control& flow) {
          return take(flow);
        }) & tbb::make_filter<Item, Item>(filter_mode::parallel, [this](Item item) {
          return prepare(std::move(item));
        }) & tbb::make_filter<Item, Item>(filter_mode::serial_in_order, [this](Item item) {
          return shade(std::move(item));
        }) & tbb::make_filter<Item, Item>(filter_mode::parallel, [this](Item item) {
          return write(std::move(item));
        }) & tbb::make_filter<Item, void>(filter_mode::serial_in_order, [this](Item item) {
          finish(std::move(item));
        }));
    strips_.write(folder_);
    return std::move(result_);
  }

 private:
  Item take(tbb::flow_control& flow) {
    context_.throw_if_cancelled();
    std::optional<SelectedFrame> next = clip_.frames.next();
    if (!next) {
      flow.stop();
      return nullptr;
    }
    auto item = std::make_shared<Work>();
    item->selected = std::move(*next);
    return item;
  }

  Item prepare(Item item) const {
    const StoredPicture& image = item->selected.image;
    item->frame = prepare_frame(image, lens_of(clip_, options_, image.color), options_.frame,
                                {.instruments = clip_.instruments ? &*clip_.instruments : nullptr,
                                 .insets = clip_.insets.size() > 0 ? &clip_.insets : nullptr});
    return item;
  }

  Item shade(Item item) {
    const bool alike = options_.from_previous && previous_ && item->selected.difference < kAlike;
    item->depth = std::make_shared<FrameDepth>(
        shade_frame(item->frame, options_.shading, alike ? previous_.get() : nullptr));
    previous_ = item->depth;
    return item;
  }

  Item write(Item item) const {
    write_frame(folder_, {item->selected.name, !clip_.camera, {}}, item->frame, *item->depth);
    return item;
  }

  void finish(Item item) {
    const std::size_t index = item->selected.index;
    FrameRecord record = record_of(index, item->selected.sharpness, item->frame, *item->depth);
    if (strips_.wants_next()) strips_.add(frame_strip(item->frame, *item->depth, 240));
    if (becomes_key(record, options_.mesh_frame, result_.key)) {
      result_.key = KeyFrame{record, std::move(item->frame), item->depth};
      result_.key_picture = std::move(item->selected.image);
    }
    result_.records.push_back(std::move(record));
    context_.debug("frame " + std::to_string(index));
  }

  Clip& clip_;
  const ShadeStageOptions& options_;
  const fs::path& folder_;
  const RunContext& context_;
  std::shared_ptr<const FrameDepth> previous_;
  StripSheet strips_;
  ClipResult result_;
};

}  // namespace

Intrinsics lens_of(const Clip& clip, const ShadeStageOptions& options, const Rgb8Image& frame) {
  return clip.camera ? *clip.camera
                     : assumed_camera(frame.width, frame.height, options.field_of_view_rad);
}

ClipResult shade_clip(Clip& clip, const ShadeStageOptions& options, const fs::path& folder,
                      const RunContext& context) {
  make_frame_folders(folder);
  return Pipeline(clip, options, folder, context).run();
}

}  // namespace organbake
