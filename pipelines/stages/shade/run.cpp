// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/formats/photo.h"
#include "organbake/geometry/ply.h"
#include "organbake/pipelines/stage.h"
#include "organbake/shading/frame_albedo.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/pictures.h"
#include "stages/shade/options.h"
#include "stages/shared/clip_outputs.h"
#include "stages/shared/clip_source.h"

namespace organbake {
namespace {

// A clip and how it was taken.
struct Clip {
  FrameSelection frames;
  std::optional<Intrinsics> camera;  // nothing = the assumed field of view
  std::optional<Mask> instruments;
  Mask insets = {};  // of the frames' size, where there are any
};

struct ClipResult {
  std::vector<FrameRecord> records;
  std::optional<KeyFrame> key;
  StoredPicture key_picture;  // before it was halved and undistorted; its lens is the clip's
};

namespace fs = std::filesystem;

constexpr std::size_t kAtOnce = 4;  // frames in memory
constexpr double kAlike = 12;       // mean difference, of 255, up to which a start is taken over

// One frame on its way through.
struct Work {
  SelectedFrame selected;
  PreparedFrame frame;
  std::shared_ptr<const FrameDepth> depth;
};

// The lens of a frame of the clip: as given, or the assumed field of view.
Intrinsics lens_of(const Clip& clip, const ShadeStageOptions& options, const Rgb8Image& frame) {
  return clip.camera ? *clip.camera
                     : assumed_camera(frame.width, frame.height, options.field_of_view_rad);
}

class Pipeline {
 public:
  Pipeline(Clip& clip, const ShadeStageOptions& options, const fs::path& folder,
           const RunContext& context)
      : clip_(clip), options_(options), folder_(folder), context_(context) {}

  ClipResult run() {
    ClipDriver<Work>()
        .at_once([this](Work& item) { prepare(item); })
        .in_turn([this](Work& item) { shade(item); })
        .at_once([this](Work& item) { write(item); })
        .in_turn([this](Work& item) { finish(item); })
        .run(kAtOnce, [this] { return take_selected<Work>(clip_.frames, context_); });
    strips_.write(folder_);
    return std::move(result_);
  }

 private:
  void prepare(Work& item) const {
    const StoredPicture& image = item.selected.image;
    item.frame = prepare_frame(image, lens_of(clip_, options_, image.color), options_.frame,
                               {.instruments = clip_.instruments ? &*clip_.instruments : nullptr,
                                .insets = clip_.insets.size() > 0 ? &clip_.insets : nullptr});
  }

  void shade(Work& item) {
    const bool alike = previous_ && item.selected.difference < kAlike;
    item.depth = std::make_shared<FrameDepth>(
        shade_frame(item.frame, options_.shading, alike ? previous_.get() : nullptr));
    previous_ = item.depth;
  }

  void write(const Work& item) const {
    write_frame(folder_, {item.selected.name, !clip_.camera, {}}, item.frame, *item.depth);
  }

  void finish(Work& item) {
    const std::size_t index = item.selected.index;
    FrameRecord record = record_of(index, item.selected.sharpness, item.frame, *item.depth);
    if (strips_.wants_next()) strips_.add(frame_strip(item.frame, *item.depth, 240));
    if (becomes_key(record, result_.key)) {
      result_.key = KeyFrame{record, std::move(item.frame), item.depth};
      result_.key_picture = std::move(item.selected.image);
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

// Decodes, prepares, shades and writes frames at the same time, a few in memory at once. Depths do
// not depend on how many threads there are: each frame starts from the one before it, in order.
ClipResult shade_clip(Clip& clip, const ShadeStageOptions& options, const fs::path& folder,
                      const RunContext& context) {
  make_frame_folders(folder);
  return Pipeline(clip, options, folder, context).run();
}

std::optional<Mask> mask_at(const fs::path* path) {
  if (!path) return std::nullopt;
  const Rgb8Image image = read_photo(*path);
  Mask mask(image.width, image.height);
  for (std::size_t k = 0; k < mask.size(); ++k)
    mask.values[k] = image.pixels[3 * k] || image.pixels[3 * k + 1] || image.pixels[3 * k + 2];
  return mask;
}

// The place and beam of the lamp from a file.
void take_lamp(const fs::path& path, LaparoscopeOptions& options) {
  if (options.beam_exponent != 0 || options.light_offset_x_mm != 0 ||
      options.light_offset_y_mm != 0)
    throw UsageError("the lamp is told twice: take --lamp, or --beam and --light-offset-mm");
  const LaparoscopeOptions lamp =
      lamp_of(lighting_from_json(read_text_file(path), path.string()), path.string());
  options.beam_exponent = lamp.beam_exponent;
  options.light_offset_x_mm = lamp.light_offset_x_mm;
  options.light_offset_y_mm = lamp.light_offset_y_mm;
}

void warn_of_what_is_assumed(const ShadeStageOptions& options, const Clip& clip,
                             const RunContext& context, StageReport& report) {
  if (!clip.camera) {
    context.warn("no intrinsics are given: a field of view of " +
                 to_text(options.field_of_view_rad * 57.29577951308232, 0) +
                 " degrees across the frame is assumed; the depth is as wrong as that is");
    report.skipped.push_back({"undistortion", "no intrinsics are given"});
  }
  if (!options.frame.masks) report.skipped.push_back({"masks", "masks is off"});
}

// What the frames themselves tell against being read as one scene under one lamp.
void warn_of_what_is_odd(const std::vector<FrameRecord>& records, const RunContext& context) {
  const auto share_of = [&](auto&& holds) {
    return static_cast<double>(std::count_if(records.begin(), records.end(), holds)) /
           static_cast<double>(records.size());
  };
  constexpr double kMost = 0.5;
  if (share_of([](const FrameRecord& r) { return r.stereo != StereoLayout::none; }) > kMost)
    context.warn(std::string("the frames hold two like pictures, ") +
                 (records.front().stereo == StereoLayout::top_bottom ? "one above the other"
                                                                     : "side by side") +
                 ": a stereo endoscope's? They are shaded as one scene, which is wrong then; cut "
                 "one eye out of them");
  if (share_of([](const FrameRecord& r) { return r.combed; }) > kMost)
    context.warn(
        "the frames' odd and even rows disagree: interlaced video, or the two eyes of an "
        "interlaced stereo picture; the even rows alone are shaded");
  if (share_of([](const FrameRecord& r) { return r.colourless; }) > kMost)
    context.warn(
        "the frames are grey: colour cannot tell instruments and tissues apart; give --instruments "
        "if there are any");
}

// What the verdicts come to: said always, and under --strict a gate.
void judge(const std::vector<FrameRecord>& records, const ShadeStageOptions& options,
           const RunContext& context, StageReport& report) {
  const std::string what = count_verdicts(records, report);
  if (what.empty()) return;
  if (options.strict) report.quality_gate = what;
  if (options.shading.model != ShadingModel::laparoscope) return context.warn(what);
  std::vector<double> kept;
  for (const FrameRecord& record : records) kept.push_back(record.quality.support);
  context.warn(what + "; of the relief that shading finds " + percent(median(std::move(kept))) +
               " is kept (median of the frames), the rest is drawn to a plane");
}

bool divides_light_out(const ShadeStageOptions& options) {
  return !options.keep_light && options.shading.model == ShadingModel::laparoscope;
}

// The colours of the surface: the frame's own, or its tissue's with the light that belongs to it.
Rgb8Image surface_color(const KeyFrame& key, const ShadeStageOptions& options, double mm_per_unit,
                        const StageCall& call, StageReport& report) {
  if (!divides_light_out(options)) {
    report.skipped.push_back(
        {"dividing the light out of the colours",
         options.keep_light ? "keep_light is on" : "a light from afar is no endoscope's lamp"});
    return key.frame.color;
  }
  return write_albedo(call.output_folder, key.frame, *key.depth, options.shading.laparoscope,
                      mm_per_unit, report);
}

// The key frame in its own pixels, coloured as the surface is.
void write_own_pixels(const ClipResult& result, const Clip& clip, const ShadeStageOptions& options,
                      const Rgb8Image& surface_color, const StageCall& call) {
  const KeyFrame& key = *result.key;
  if (options.frame.halvings == 0)
    return write_scope_photo(call.output_folder, surface_color, key.frame.camera);
  const StoredPicture& picture = result.key_picture;
  const PreparedFrame whole = prepare_frame(picture, lens_of(clip, options, picture.color),
                                            {.masks = false, .piecewise_albedo = false});
  write_scope_photo(
      call.output_folder,
      divides_light_out(options)
          ? with_own_pixels(surface_color, key.frame, whole.color, options.frame.halvings)
          : whole.color,
      whole.camera);
}

// The bundle is in millimetres. Of a relative depth the median is put where laparoscopes work.
void write_surface(const ClipResult& result, const Clip& clip, const ShadeStageOptions& options,
                   const StageCall& call, StageReport& report) {
  const KeyFrame& key = *result.key;
  constexpr double kAssumedRange_mm = 60;
  Plane depth = key.depth->depth;
  const double mm_per_unit = key.depth->metric ? 1 : kAssumedRange_mm;
  const Rgb8Image color = surface_color(key, options, mm_per_unit, call, report);
  write_own_pixels(result, clip, options, color, call);
  if (!key.depth->metric) {
    for (float& z : depth.values) z *= static_cast<float>(kAssumedRange_mm);
    call.context.warn(
        "the depth is relative; surface.ply has its median at an assumed 60 mm "
        "(give --range-mm or --albedo-mm2)");
  }
  const TriangleMesh mesh = mesh_from_depth(depth, color, key.frame.camera, options.mesh);
  write_ply(call.output_folder / "surface.ply", mesh);
  report.add("surface_frame", key.record.index);
  report.add("surface_faces", mesh.faces.size());
  report.add("surface_scale", key.depth->metric ? "mm" : "assumed: median depth 60 mm");
  report.skipped.push_back({"what the frame cannot have seen",
                            "one viewpoint shows one side: "
                            "masked and occluded parts are left open"});
}

StageReport run(const StageCall& call) {
  auto options = call.options_as<ShadeStageOptions>();
  options.resolve();
  if (const fs::path* lamp = call.input("lamp")) take_lamp(*lamp, options.shading.laparoscope);
  options.shading.check();
  ShadeSource source = open_frames(*call.input("frames"), call.input("intrinsics"), call.context);
  Clip clip{FrameSelection(std::move(source.next), options.selection), source.camera,
            mask_at(call.input("instruments")),
            insets_of(*call.input("frames"), call.input("intrinsics"), call.context)};
  StageReport report;
  warn_of_what_is_assumed(options, clip, call.context, report);
  const ClipResult result = shade_clip(clip, options, call.output_folder, call.context);
  report.bad_data = clip.frames.damage();
  if (result.records.empty()) {
    throw BadDataError(report.bad_data.empty() ? "the clip holds no frame" : report.bad_data);
  }
  report.add("frames_read", clip.frames.frames_read());
  report.add("frames_shaded", result.records.size());
  report.add("frames_duplicate", clip.frames.duplicates());
  report.add("frames_blurred", clip.frames.blurred());
  report.add("inset_share", share_of(clip.insets));
  report.add("depth_unit", result.records.front().metric ? "mm" : "relative, median 1");
  report_frames(result.records, report);
  const auto list = [&](const char* name, const auto& value) {
    report_each(report, name, result.records, value);
  };
  list("frame_residual", [](const FrameRecord& r) { return r.residual; });
  list("frame_support", [](const FrameRecord& r) { return r.quality.support; });
  list("frame_unshaped", [](const FrameRecord& r) { return r.quality.unexplained; });
  report.add("frames_warm", std::count_if(result.records.begin(), result.records.end(),
                                          [](const FrameRecord& r) { return r.warm; }));
  if (clip.insets.size() > 0) call.context.warn(told_of_insets(share_of(clip.insets)));
  warn_of_what_is_odd(result.records, call.context);
  warn_of_instruments(result.records, clip.instruments.has_value(), call.context);
  judge(result.records, options, call.context, report);
  write_surface(result, clip, options, call, report);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
