// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/lighting.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/formats/camera_files.h"
#include "organbake/fusion/fuse_views.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/ply.h"
#include "organbake/motion/key_depths.h"
#include "organbake/pipelines/stage.h"
#include "organbake/shading/frame_albedo.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/pictures.h"
#include "organbake/shading/prepared_frame.h"
#include "stages/motion/motion_clip.h"
#include "stages/shared/clip_outputs.h"
#include "stages/shared/posed_depth.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Brings all lengths to `factor` times what they are, and makes the camera of one frame the world:
// whoever looks from there sees the tissue as that frame shows it.
void scale_and_place(double factor, const RigidTransform& camera_from_world, ClipMotion& motion,
                     std::vector<KeyDepth>& keys) {
  // new world = that camera, its lengths scaled
  const RigidTransform old_from_camera = camera_from_world.inverse();
  const auto moved = [&](const RigidTransform& pose) {
    RigidTransform now = pose * old_from_camera;
    now.translation *= factor;
    return now;
  };
  for (auto* poses : {&motion.scene.camera_from_world, &motion.camera_from_world})
    for (auto& pose : *poses)
      if (pose) pose = moved(*pose);
  for (Landmark& landmark : motion.scene.landmarks)
    if (landmark.place) {
      landmark.place = factor * (camera_from_world * *landmark.place);
      landmark.push = factor * (camera_from_world.rotation * landmark.push);
    }
  if (motion.breath) motion.breath->move(camera_from_world, factor);
  for (KeyDepth& key : keys) {
    key.camera_from_world = moved(key.camera_from_world);
    for (float& z : key.depth.depth.values) z *= static_cast<float>(factor);
  }
}

// The key frames as they are fused.
std::vector<DepthView> depth_views(const FollowedClip& clip, const std::vector<KeyDepth>& keys) {
  std::vector<DepthView> views;
  for (const KeyDepth& key : keys) {
    DepthView view;
    view.name = clip.names[key.frame];
    view.camera = {view.name, key.prepared.camera, key.camera_from_world};
    view.depth_mm = key.depth.depth;
    view.confidence = key.depth.confidence;
    view.color = key.prepared.color;
    view.color_lens = key.prepared.camera;
    views.push_back(std::move(view));
  }
  return views;
}

constexpr double kAssumedRange_mm = 60, kLeastSupport = 0.25;
// Of the median distance: parallax of a hand-held scope errs by about a hundredth of it, and finer
// voxels would make handles of what depth maps disagree about. Colours are finer than that.
constexpr double kVoxelShare = 0.022, kColorShare = 0.006;

// Cameras of another program, by their frames' names.
std::vector<std::optional<RigidTransform>> given_poses(const fs::path& path,
                                                       const FollowedClip& clip,
                                                       const RunContext& context) {
  const CameraSet set = read_camera_file(path, context);
  const MatchedPoses matched = match_poses({clip.names.begin(), clip.names.end()}, set, path);
  std::vector<std::optional<RigidTransform>> poses;
  for (const auto& camera : matched.camera)
    poses.push_back(camera ? std::optional(set.cameras[*camera].camera_from_world) : std::nullopt);
  return poses;
}

ClipMotion motion_of(const StageCall& call, const FollowedClip& clip,
                     const MotionStageOptions& options, const PictureLoader& load) {
  MotionOptions search;
  if (!clip.lens) search.lens = {.focal = true, .distortion = true};
  Intrinsics lens =
      clip.lens ? *clip.lens
                : assumed_camera(clip.tracks.width, clip.tracks.height, options.field_of_view_rad);
  if (!clip.lens && clip.stop_center) {
    lens.cx = clip.stop_center->x();
    lens.cy = clip.stop_center->y();
  }
  if (const fs::path* poses = call.input("poses")) {
    if (!clip.lens)
      throw UsageError("poses need the lens that they were found with: give --intrinsics " +
                       poses->string());
    return motion_of_poses(search, clip.tracks, lens, given_poses(*poses, clip, call.context),
                           load);
  }
  return find_motion(search, clip.tracks, clip.sharpness, lens, load, call.context);
}

double median_depth(const std::vector<KeyDepth>& keys) {
  std::vector<float> depths;
  for (const KeyDepth& key : keys)
    for (std::size_t k = 0; k < key.depth.depth.size(); k += 7)
      if (std::isfinite(key.depth.depth.values[k])) depths.push_back(key.depth.depth.values[k]);
  return median(std::move(depths));
}

void report_motion(const FollowedClip& clip, const ClipMotion& motion, StageReport& report) {
  const Scene& scene = motion.scene;
  const auto posed = std::count_if(motion.camera_from_world.begin(), motion.camera_from_world.end(),
                                   [](const auto& pose) { return pose.has_value(); });
  report.add("frames_read", clip.names.size());
  report.add("frames_posed", posed);
  report.add("views_posed", scene.posed_views());
  report.add("points", motion.points);
  report.add("mean_error_px", motion.mean_error_px);
  report.add("median_angle_rad", motion.median_angle_rad);
  report.add("lens", clip.lens ? "given" : "found");
  report.add("focal_px", scene.lens.fx);
  report.add("focal_sd_px", motion.lens_spread.focal_px);
  report.add("k1", scene.lens.k1);
  report.add("k1_sd", motion.lens_spread.k1);
  report.add("verdict", name_of(motion.quality.verdict));
  report.add("runner_up", motion.quality.runner_up);
  report.add("lamp_correlation", motion.quality.lamp_correlation);
  report.add("lamp_slope", motion.quality.lamp_slope);
  report.add("breath_period_frames", motion.breath_period_frames);
  report.add("inset_share", share_of(clip.insets));
}

std::string name_of(const FrameSpan& span) {
  return span.first == span.last
             ? "frame " + std::to_string(span.first)
             : "frames " + std::to_string(span.first) + " to " + std::to_string(span.last);
}

// What of the clip has no pose, and why: the surface does not show it.
void tell_left_out(const ClipMotion& motion, const RunContext& context, StageReport& report) {
  for (const FrameSpan& span : motion.left_out)
    report.skipped.push_back({name_of(span), span.reason});
  const std::size_t frames = motion.camera_from_world.size();
  const auto without = static_cast<std::size_t>(
      std::count(motion.camera_from_world.begin(), motion.camera_from_world.end(), std::nullopt));
  if (without == 0) return;
  std::string why;
  for (const FrameSpan& span : motion.left_out)
    why += (why.empty() ? ": " : "; ") + name_of(span) + ": " + span.reason;
  context.warn(std::to_string(without) + " of the " + std::to_string(frames) +
               " frames are left out, as they have no pose" +
               (why.empty() ? ": too little of what they show agrees with the scene" : why));
}

void tell_motion(const FollowedClip& clip, const ClipMotion& motion, const RunContext& context,
                 StageReport& report) {
  if (clip.insets.size() > 0) context.warn(told_of_insets(share_of(clip.insets)));
  tell_left_out(motion, context, report);
  if (!motion.scene.breath.empty())
    context.info("the tissue breathes, once in " + to_text(motion.breath_period_frames, 1) +
                 " frames: surface and points are of its rest");
  const MotionQuality& quality = motion.quality;
  if (!motion.failure.empty() || quality.verdict == DepthVerdict::ok) return;
  const std::string told =
      std::string("the scene is judged ") + name_of(quality.verdict) + ": " + quality.reason;
  context.warn(clip.lens ? told : told + "; give the lens (--intrinsics)");
}

void write_keys(const fs::path& folder, const FollowedClip& clip, const std::vector<KeyDepth>& keys,
                StageReport& report) {
  make_frame_folders(folder);
  StripSheet strips;
  std::vector<double> frames;
  for (const KeyDepth& key : keys) {
    write_frame(folder,
                {.name = clip.names[key.frame], .assumed_lens = false, .camera_from_scope = {}},
                key.prepared, key.depth);
    if (strips.wants_next()) strips.add(frame_strip(key.prepared, key.depth, 320));
    frames.push_back(static_cast<double>(key.frame));
  }
  strips.write(folder);
  report.add("key_frame", frames);
}

void write_surface(const StageCall& call, const FollowedClip& clip,
                   const std::vector<KeyDepth>& keys, const MotionStageOptions& options,
                   StageReport& report) {
  FusionOptions fusion;
  const double usual_mm = median_depth(keys);
  fusion.voxel_mm = kVoxelShare * usual_mm;
  fusion.color_mm = kColorShare * usual_mm;
  fusion.least_support = kLeastSupport;
  fusion.light = options.keep_light ? PictureLight::any : PictureLight::camera;
  const FusedSurface fused = fuse_views(depth_views(clip, keys), fusion, call.context);
  write_ply(call.output_folder / "surface.ply", fused.mesh);
  if (!options.keep_light)
    write_file_atomically(call.output_folder / kLightingFile,
                          lighting_to_json(laparoscope_lighting({})));
  report.add("surface_faces", fused.mesh.faces.size());
  report.add("surface_area_mm2", surface_area(fused.mesh));
  report.add("surface_voxel_mm", fused.voxel_mm);
  report.add("surface_apart_mm", fused.apart_mm);
  report.add("surface_colored_share", fused.colored_share);
}

// What makes the scene's unit millimetres, first come; and how sure it is.
struct SceneScale {
  double factor = 1;
  std::string how;
  std::optional<KnownScale> known;
  bool metric = true;
};

// Before an hour's work: a length below a millimetre is one in metres.
void check_lengths(const MotionStageOptions& options) {
  for (const auto& [name, value] :
       {std::pair{"range_mm", options.range_mm}, std::pair{"shaft_mm", options.shaft_mm}})
    if (value != 0 && value < 1)
      throw UsageError(std::string(name) + " is " + to_text(value) +
                       "; it is in mm, at least 1 (60, not 0.06, for 6 cm), or 0 where it is not "
                       "known");
}

SceneScale scale_of(const StageCall& call, const MotionStageOptions& options,
                    const ClipMotion& motion, const std::vector<KeyDepth>& keys) {
  const auto known = [](const KnownScale& scale, const char* how) {
    return SceneScale{scale.mm_per_unit, how, scale};
  };
  if (!options.known_distance.empty())
    return known(scale_by_distance(parse_known_distance(options.known_distance), motion, keys),
                 "known_distance");
  if (options.shaft_mm > 0) return known(scale_by_shaft(options.shaft_mm, keys), "shaft_mm");
  if (options.range_mm > 0) return {options.range_mm / median_depth(keys), "range_mm", {}};
  if (call.input("poses")) return {1, "poses", {}};
  return {kAssumedRange_mm / median_depth(keys), "assumed: median depth 60 mm", {}, false};
}

void tell_scale(const SceneScale& scale, const RunContext& context, StageReport& report) {
  report.add("scale", scale.how);
  if (scale.known) {
    const auto& [factor, spread, frames] = *scale.known;
    report.add("scale_sd_share", spread);
    report.add("scale_frames", frames);
    context.info("lengths are by " + scale.how + " to " + percent(spread, 1) + " (" +
                 std::to_string(frames) + (frames == 1 ? " key frame)" : " key frames)"));
    if (scale.how == "shaft_mm")
      context.info(
          "the shaft's tip is taken to touch the tissue where it comes nearest to it; "
          "where it never does, all is larger");
  }
  if (!scale.metric)
    context.warn(
        "the clip tells no scale: the median depth is put at an assumed 60 mm (give --range-mm, "
        "--shaft-mm or --known-distance)");
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<MotionStageOptions>();
  check_lengths(options);
  if (!options.known_distance.empty()) parse_known_distance(options.known_distance);
  ClipPictures pictures(call);
  const PictureLoader load = [&](const auto& frames) { return pictures.load(frames); };
  const FollowedClip clip = follow_clip(call, pictures);
  StageReport report;
  report.bad_data = clip.damage;
  ClipMotion motion = motion_of(call, clip, options, load);
  if (!motion.failure.empty() && flickers(clip.brightness))
    motion.failure =
        "the frames' brightness jumps from one to the next, as under a stroboscope or "
        "a lamp that flickers, and no feature can be followed through it; take frames "
        "of one phase of the light (a folder of every second frame, say)";
  report_motion(clip, motion, report);
  tell_motion(clip, motion, call.context, report);
  std::vector<KeyDepth> keys;
  try {
    if (motion.failure.empty())
      keys = key_depths({options.key_frames, options.halvings, options.shading, clip.insets},
                        motion, load, call.context);
  } catch (const BadDataError& error) {  // poses alone, of a scope that only turned, tell no shape
    motion.failure = error.what();
  }
  if (!motion.failure.empty()) {
    report.declined = clip.damage.empty() ? motion.failure : clip.damage + "; " + motion.failure;
    return report;
  }
  const SceneScale scale = scale_of(call, options, motion, keys);
  const std::size_t middle = keys[keys.size() / 2].frame;
  scale_and_place(scale.factor, *motion.camera_from_world[middle], motion, keys);
  for (KeyDepth& key : keys) key.depth.metric = scale.metric;
  tell_scale(scale, call.context, report);
  pictures.load(motion.view_frames);
  write_scene(call.output_folder, clip, motion, pictures);
  write_overlay(call.output_folder, motion, pictures, middle);
  write_keys(call.output_folder, clip, keys, report);
  write_surface(call, clip, keys, options, report);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
