// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/stereo/stereo_clip.h"

#include <tbb/parallel_pipeline.h>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/shading/pictures.h"
#include "stages/stereo/stereo_source.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPairsAtOnce = 3;  // in memory

// One pair on its way through.
struct PairWork {
  SelectedFrame selected;
  PreparedFrame left;
  std::shared_ptr<const FrameDepth> depth;
  PairRecord record;
  BeamRings rings;  // unless the light is kept
};
using PairItem = std::shared_ptr<PairWork>;

class PairPipeline {
 public:
  PairPipeline(FrameSelection& frames, const Rectifier& rectifier, const EyeInsets& insets,
               const StereoStageOptions& options, const fs::path& folder, const RunContext& context)
      : frames_(frames),
        rectifier_(rectifier),
        insets_(insets),
        options_(options),
        folder_(folder),
        context_(context) {}

  StereoClipResult run() {
    using tbb::filter_mode;
    tbb::parallel_pipeline(
        kPairsAtOnce,
        tbb::make_filter<void, PairItem>(filter_mode::serial_in_order,
                                         [this](tbb::flow_control& flow) { return take(flow); }) &
            tbb::make_filter<PairItem, PairItem>(
                filter_mode::parallel, [this](PairItem item) { return match(std::move(item)); }) &
            tbb::make_filter<PairItem, void>(filter_mode::serial_in_order,
                                             [this](PairItem item) { finish(std::move(item)); }));
    strips_.write(folder_);
    result_.beam = estimate_beam(rings_);
    return std::move(result_);
  }

 private:
  PairItem take(tbb::flow_control& flow) {
    context_.throw_if_cancelled();
    std::optional<SelectedFrame> next = frames_.next();
    if (!next) {
      flow.stop();
      return nullptr;
    }
    auto item = std::make_shared<PairWork>();
    item->selected = std::move(*next);
    return item;
  }

  PairItem match(PairItem item) const {
    const RectifiedEyes& eyes = rectifier_.eyes();
    const StoredPicture& both = item->selected.image;
    PreparedEyes ready = prepare_eyes(left_of(both), right_of(both), rectifier_, options_.stereo,
                                      options_.masks, insets_);
    item->left = std::move(ready.left);
    item->selected.image = StoredPicture();
    try {
      StereoDepth found = stereo_depth(item->left, ready.right, eyes, options_.stereo);
      item->record = {{},
                      found.matched_share,
                      found.filled_share,
                      found.covered_share,
                      found.relative_sd,
                      found.rows_apart_px,
                      ready.corrected};
      item->depth = std::make_shared<FrameDepth>(std::move(found.depth));
    } catch (const BadDataError& error) {
      throw BadDataError("frame " + std::to_string(item->selected.index) + ": " + error.what());
    }
    if (!options_.keep_light)
      item->rings = beam_rings(item->left, item->depth->depth, item->depth->confidence);
    write(*item);
    return item;
  }

  void write(PairWork& item) const {
    const std::size_t index = item.selected.index;
    // Each eye shows one scene, however much its halves look alike.
    item.left.stereo = StereoLayout::none;
    item.record.frame = record_of(index, item.selected.sharpness, item.left, *item.depth);
    write_frame(folder_, {item.selected.name, false, rectifier_.eyes().rectified_from_left},
                item.left, *item.depth);
  }

  void finish(PairItem item) {
    const FrameRecord& record = item->record.frame;
    if (strips_.wants_next()) strips_.add(frame_strip(item->left, *item->depth, 240));
    result_.records.push_back(item->record);
    if (!options_.keep_light) rings_.push_back(item->rings);
    context_.debug("frame " + std::to_string(record.index));
    if (becomes_key(record, options_.mesh_frame, result_.key))
      result_.key = KeyFrame{record, std::move(item->left), item->depth};
  }

  FrameSelection& frames_;
  const Rectifier& rectifier_;
  const EyeInsets& insets_;
  const StereoStageOptions& options_;
  const fs::path& folder_;
  const RunContext& context_;
  StripSheet strips_;
  std::vector<BeamRings> rings_;
  StereoClipResult result_;
};

}  // namespace

StereoClipResult match_clip(FrameSelection& frames, const Rectifier& rectifier,
                            const EyeInsets& insets, const StereoStageOptions& options,
                            const fs::path& folder, const RunContext& context) {
  make_frame_folders(folder);
  return PairPipeline(frames, rectifier, insets, options, folder, context).run();
}

}  // namespace organbake
