// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <filesystem>

#include "bundle/cameras_json.h"
#include "core/error.h"
#include "core/file_ending.h"
#include "core/files.h"
#include "core/text.h"
#include "formats/photo.h"
#include "geometry/ply.h"
#include "pipelines/stage_module.h"
#include "pipelines/stage_options.h"
#include "pipelines/stages/shade_clip.h"
#include "shading/video_reader.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// The frames of a folder in the order of their names; the first one's size is the clip's.
FrameSelection::NextFrame pictures_in(std::vector<fs::path> files) {
  return [files = std::move(files), at = std::size_t{0}, width = 0,
          height = 0](Rgb8Image& image) mutable {
    if (at == files.size()) return false;
    const std::string name = "frame " + std::to_string(at) + ": ";
    try {
      image = read_photo(files[at]);
    } catch (const Error& error) {
      throw BadDataError(name + error.what());
    }
    if (at == 0) {
      width = image.width;
      height = image.height;
    }
    if (image.width != width || image.height != height)
      throw BadDataError(name + files[at].string() + " is " + std::to_string(image.width) + "x" +
                         std::to_string(image.height) + ", the frames before are " +
                         std::to_string(width) + "x" + std::to_string(height));
    ++at;
    return true;
  };
}

FrameSelection::NextFrame frames_at(const fs::path& path) {
  if (fs::is_directory(path)) {
    std::vector<fs::path> files;
    for (const fs::path& file : list_files(path))
      if (is_picture_name(file)) files.push_back(path / file);
    if (files.empty()) throw BadDataError(path, "holds no PNG or JPEG frames");
    return pictures_in(std::move(files));
  }
  if (is_picture_name(path)) return pictures_in({path});
  auto video = std::make_shared<VideoReader>(path);
  return [video](Rgb8Image& image) { return video->next(image); };
}

std::optional<Intrinsics> camera_at(const fs::path* path) {
  if (!path) return std::nullopt;
  const CameraSet set = read_cameras(*path);
  if (set.cameras.empty()) throw BadDataError(*path, "holds no camera");
  return set.cameras.front().intrinsics;
}

std::optional<Mask> mask_at(const fs::path* path) {
  if (!path) return std::nullopt;
  const Rgb8Image image = read_photo(*path);
  Mask mask(image.width, image.height);
  for (std::size_t k = 0; k < mask.size(); ++k)
    mask.values[k] = image.pixels[3 * k] || image.pixels[3 * k + 1] || image.pixels[3 * k + 2];
  return mask;
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
  if (!options.frame.piecewise_albedo)
    report.skipped.push_back({"piecewise albedo", "piecewise_albedo is off"});
}

// The bundle is in millimetres. Of a relative depth the median is put where laparoscopes work.
void write_surface(const KeyFrame& key, const ShadeStageOptions& options, const StageCall& call,
                   StageReport& report) {
  constexpr double kAssumedRange_mm = 60;
  Plane depth = key.depth->depth;
  if (!key.depth->metric) {
    for (float& z : depth.values) z *= static_cast<float>(kAssumedRange_mm);
    call.context.warn(
        "the depth is relative; surface.ply has its median at an assumed 60 mm "
        "(give --range-mm or --albedo)");
  }
  const TriangleMesh mesh = mesh_from_depth(depth, key.frame.color, key.frame.camera, options.mesh);
  write_ply(call.output_folder / "surface.ply", mesh);
  report.add("surface_frame", key.record.index);
  report.add("surface_faces", mesh.faces.size());
  report.add("surface_scale", key.depth->metric ? "mm" : "assumed: median depth 60 mm");
  report.skipped.push_back({"what the frame cannot have seen",
                            "one viewpoint shows one side: "
                            "masked and occluded parts are left open"});
}

StageReport run(const StageCall& call) {
  auto options = resolved_options<ShadeStageOptions>(call.options_json);
  options.resolve();
  options.shading.check();
  Clip clip{FrameSelection(frames_at(*call.input("frames")), options.selection),
            camera_at(call.input("intrinsics")), mask_at(call.input("instruments"))};
  StageReport report;
  warn_of_what_is_assumed(options, clip, call.context, report);
  const ClipResult result = shade_clip(clip, options, call.output_folder, call.context);
  report.bad_data = clip.frames.damage();
  if (result.records.empty()) {
    throw BadDataError(report.bad_data.empty() ? "the clip holds no frame" : report.bad_data);
  }
  write_file_atomically(call.output_folder / "plot.svg", plot_of(result.records));
  report.add("frames_read", clip.frames.frames_read());
  report.add("frames_shaded", result.records.size());
  report.add("frames_duplicate", clip.frames.duplicates());
  report.add("frames_blurred", clip.frames.blurred());
  report.add("depth_unit", result.records.front().metric ? "mm" : "relative, median 1");
  report_frames(result.records, report);
  if (result.records.front().ambiguous)
    call.context.warn("the light is nearly frontal: hills and hollows look alike to this model");
  if (result.key) {
    write_surface(*result.key, options, call, report);
  } else {
    throw UsageError("mesh_frame is " + std::to_string(options.mesh_frame) +
                     "; that frame of the clip was not shaded");
  }
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
