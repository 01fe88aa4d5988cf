// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/ply.h"
#include "organbake/pipelines/stage.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/frame_albedo.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/pictures.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/stereo/stereo_depth.h"
#include "stages/shared/clip_outputs.h"
#include "stages/shared/clip_source.h"
#include "stages/shared/options.h"
#include "stages/stereo/options.h"
#include "stages/stereo/stereo_source.h"

namespace organbake {
namespace {

// What the report keeps of a pair of pictures besides.
struct PairRecord {
  FrameRecord frame;
  double matched_share = 0, filled_share = 0, covered_share = 0, relative_sd = 0;
  double rows_apart_px = 0;
  RowAlignment corrected;
};

struct StereoClipResult {
  std::vector<PairRecord> records;
  BeamEstimate beam;  // of the lamp, taken to lie at the left lens; unless its light is kept
  std::optional<KeyFrame> key;  // the left eye's
};

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
    ClipDriver<PairWork>()
        .at_once([this](PairWork& item) { match(item); })
        .in_turn([this](PairWork& item) { finish(item); })
        .run(kPairsAtOnce, [this] { return take_selected<PairWork>(frames_, context_); });
    strips_.write(folder_);
    result_.beam = estimate_beam(rings_);
    return std::move(result_);
  }

 private:
  void match(PairWork& item) const {
    const RectifiedEyes& eyes = rectifier_.eyes();
    const StoredPicture& both = item.selected.image;
    PreparedEyes ready = prepare_eyes(left_of(both), right_of(both), rectifier_, options_.stereo,
                                      options_.masks, insets_);
    item.left = std::move(ready.left);
    item.selected.image = StoredPicture();
    try {
      StereoDepth found = stereo_depth(item.left, ready.right, eyes, options_.stereo);
      item.record = {{},
                     found.matched_share,
                     found.filled_share,
                     found.covered_share,
                     found.relative_sd,
                     found.rows_apart_px,
                     ready.corrected};
      item.depth = std::make_shared<FrameDepth>(std::move(found.depth));
    } catch (const BadDataError& error) {
      throw BadDataError("frame " + std::to_string(item.selected.index) + ": " + error.what());
    }
    if (!options_.keep_light)
      item.rings = beam_rings(item.left, item.depth->depth, item.depth->confidence);
    write(item);
  }

  void write(PairWork& item) const {
    const std::size_t index = item.selected.index;
    // Each eye shows one scene, however much its halves look alike.
    item.left.stereo = StereoLayout::none;
    item.record.frame = record_of(index, item.selected.sharpness, item.left, *item.depth);
    write_frame(folder_, {item.selected.name, false, rectifier_.eyes().rectified_from_left},
                item.left, *item.depth);
  }

  void finish(PairWork& item) {
    const FrameRecord& record = item.record.frame;
    if (strips_.wants_next()) strips_.add(frame_strip(item.left, *item.depth, 240));
    result_.records.push_back(item.record);
    if (!options_.keep_light) rings_.push_back(item.rings);
    context_.debug("frame " + std::to_string(record.index));
    if (becomes_key(record, result_.key))
      result_.key = KeyFrame{record, std::move(item.left), item.depth};
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

// Decodes, rectifies, matches and writes pairs at the same time, a few in memory at once. A pair's
// depth depends on no other pair.
StereoClipResult match_clip(FrameSelection& frames, const Rectifier& rectifier,
                            const EyeInsets& insets, const StereoStageOptions& options,
                            const fs::path& folder, const RunContext& context) {
  make_frame_folders(folder);
  return PairPipeline(frames, rectifier, insets, options, folder, context).run();
}

// World is the left camera as it was calibrated.
CameraSet rectified_cameras(const RectifiedEyes& eyes) {
  CameraSet set;
  set.cameras = {{"left", eyes.camera, {}}, eyes.right()};
  for (PosedCamera& camera : set.cameras)
    camera.camera_from_world = camera.camera_from_world * eyes.rectified_from_left;
  return set;
}

std::vector<FrameRecord> left_frames(const std::vector<PairRecord>& records) {
  std::vector<FrameRecord> frames;
  for (const PairRecord& record : records) frames.push_back(record.frame);
  return frames;
}

void report_pairs(const std::vector<PairRecord>& records, StageReport& report) {
  report_frames(left_frames(records), report);
  const auto list = [&](const char* name, const auto& value) {
    report_each(report, name, records, value);
  };
  list("frame_matched_share", [](const PairRecord& r) { return r.matched_share; });
  list("frame_filled_share", [](const PairRecord& r) { return r.filled_share; });
  list("frame_covered_share", [](const PairRecord& r) { return r.covered_share; });
  list("frame_relative_sd", [](const PairRecord& r) { return r.relative_sd; });
  list("frame_rows_apart_px", [](const PairRecord& r) { return r.rows_apart_px; });
  list("frame_rows_corrected_px", [](const PairRecord& r) { return r.corrected.shift_px; });
  list("frame_roll_corrected_deg",
       [](const PairRecord& r) { return degrees(r.corrected.roll_rad); });
}

void judge_pairs(const std::vector<PairRecord>& records, const StereoStageOptions& options,
                 const RunContext& context, StageReport& report) {
  const std::vector<FrameRecord> frames = left_frames(records);
  warn_of_instruments(frames, false, context);
  const std::string what = count_verdicts(frames, report);
  if (what.empty()) return;
  if (options.strict) report.quality_gate = what;
  context.warn(what);
}

// Says what was taken out of the right pictures, as the median of those that needed it.
void tell_of_rows(const std::vector<PairRecord>& records, const RunContext& context) {
  std::vector<double> shifts, rolls;
  for (const PairRecord& record : records) {
    if (!record.corrected.needed()) continue;
    shifts.push_back(record.corrected.shift_px);
    rolls.push_back(degrees(record.corrected.roll_rad));
  }
  if (shifts.empty()) return;
  const std::string frames = std::to_string(shifts.size()) + " of " +
                             std::to_string(records.size()) +
                             (records.size() == 1 ? " pair" : " pairs");
  context.warn("the rows of the eyes were " + to_text(median(std::move(shifts)), 1) +
               " px apart and the right picture rolled by " + to_text(median(std::move(rolls)), 2) +
               " degrees, as features of both pictures tell; that was corrected in " + frames +
               ". The calibration is not quite that of these pictures: calibrate anew where "
               "depth must be exact");
}

// How the lamp falls off to the sides, as far as the clip tells.
LaparoscopeOptions learned_lamp(const BeamEstimate& beam, StageReport& report) {
  LaparoscopeOptions lamp;
  if (beam.sectors > 0) {
    report.add("beam_exponent", beam.exponent);
    report.add("beam_exponent_sd", beam.sd);
  }
  constexpr double kNarrowest = 20;
  if (beam.told()) {
    lamp.beam_exponent = std::min(beam.exponent, kNarrowest);
  } else {
    report.skipped.push_back(
        {"the lamp's beam", beam.sectors > 0
                                ? "it is even, or its fall-off is not told from texture"
                                : "too little of the picture is matched to tell it"});
  }
  return lamp;
}

// The lamp is taken to lie at the left lens. Matching errs from pixel to pixel: light is divided
// out as a smooth surface would have it.
Rgb8Image surface_color(const KeyFrame& key, const BeamEstimate& beam,
                        const StereoStageOptions& options, const StageCall& call,
                        StageReport& report) {
  if (options.keep_light) {
    report.skipped.push_back({"dividing the light out of the colours", "keep_light is on"});
    return key.frame.color;
  }
  FrameDepth smooth = *key.depth;
  const RayGrid rays = ray_grid(key.frame.camera);
  smooth.normals = smooth_normals_from_depth(smooth.depth, rays, smooth_normals_radius_px(rays));
  return write_albedo(call.output_folder, key.frame, smooth, learned_lamp(beam, report), 1, report);
}

// The surface that the bundle is made of; what of the depth it leaves out is said.
TriangleMesh largest_piece(const KeyFrame& key, const Rgb8Image& color, DepthMeshOptions options,
                           const RunContext& context) {
  const auto meshed = [&](bool largest_only) {
    options.largest_only = largest_only;
    return mesh_from_depth(key.depth->depth, color, key.frame.camera, options);
  };
  TriangleMesh mesh = meshed(true);
  const auto all = static_cast<double>(meshed(false).faces.size());
  const double left_out = 1 - static_cast<double>(mesh.faces.size()) / all;
  constexpr double kTold = 0.02;
  if (left_out > kTold)
    context.warn("surface.ply is the largest piece of the depth; " + percent(left_out) +
                 " of it lies in other pieces, before or behind, and is left out (a larger "
                 "--tear joins what is no farther apart; depth/ has all of it)");
  return mesh;
}

TriangleMesh mesh_of(const KeyFrame& key, const BeamEstimate& beam,
                     const StereoStageOptions& options, const StageCall& call,
                     StageReport& report) {
  try {
    const Rgb8Image color = surface_color(key, beam, options, call, report);
    write_scope_photo(call.output_folder, color, key.frame.camera);
    return largest_piece(key, color, options.mesh, call.context);
  } catch (const BadDataError& error) {
    const std::string& reason = key.record.quality.reason;
    throw BadDataError("the eyes' pictures give no surface: " +
                       (reason.empty() ? std::string(error.what()) : reason) +
                       "; do they and the calibration belong together?");
  }
}

void write_pair_surface(const StereoClipResult& clip, const RectifiedEyes& eyes,
                        const StereoStageOptions& options, const StageCall& call,
                        StageReport& report) {
  const KeyFrame& key = *clip.key;
  TriangleMesh mesh = mesh_of(key, clip.beam, options, call, report);
  const Eigen::Matrix3d left_from_rectified = eyes.rectified_from_left.rotation.transpose();
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = left_from_rectified * vertex;
  write_ply(call.output_folder / "surface.ply", mesh);
  report.add("surface_frame", key.record.index);
  report.add("surface_faces", mesh.faces.size());
  report.add("surface_scale", "mm");
  report.skipped.push_back({"what the left eye cannot have seen",
                            "one place shows one side: masked and occluded parts are left open"});
}

// What a recorder has laid over either eye.
EyeInsets find_eye_insets(const StageCall& call, const StereoStageOptions& options) {
  const fs::path& left = *call.input("left");
  const fs::path* right = call.input("right");
  const auto of = [&](const auto& eye_of) {
    const RunContext quiet(nullptr, nullptr, nullptr);  // all is said when they are matched
    EyeSource source = open_eyes(left, right, options, quiet);
    return insets_of(
        [&](StoredPicture& picture) {
          if (!source.next(picture)) return false;
          picture = eye_of(picture);
          return true;
        },
        call.context);
  };
  return {of(left_of), of(right_of)};
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<StereoStageOptions>();
  options.stereo.check();
  const fs::path &left = *call.input("left"), &calibration = *call.input("calibration");
  EyeSource source = open_eyes(left, call.input("right"), options, call.context);
  const StereoRig rig = read_stereo_rig(
      calibration,
      {source.eye.width, source.eye.height, source.left, source.right, mm_per(options.unit)});
  const Rectifier rectifier(rig);
  if (const std::string told = told_of_fisheye(rig.left); !told.empty()) call.context.info(told);
  FrameSelection frames(std::move(source.next), selection_of(options.every, options.sharpest));
  StageReport report;
  const EyeInsets insets = find_eye_insets(call, options);
  const double inset_share = std::max(share_of(insets.left), share_of(insets.right));
  const StereoClipResult result =
      match_clip(frames, rectifier, insets, options, call.output_folder, call.context);
  report.bad_data = frames.damage();
  if (result.records.empty())
    throw BadDataError(report.bad_data.empty() ? "the clip holds no frame" : report.bad_data);
  const RectifiedEyes& eyes = rectifier.eyes();
  write_file_atomically(call.output_folder / "cameras.json",
                        cameras_to_json(rectified_cameras(eyes)));
  report.add("frames_read", frames.frames_read());
  report.add("frames_matched", result.records.size());
  report.add("frames_duplicate", frames.duplicates());
  report.add("frames_blurred", frames.blurred());
  report.add("inset_share", inset_share);
  if (inset_share > 0) call.context.warn(told_of_insets(inset_share));
  report.add("depth_unit", "mm");
  report.add("baseline_mm", eyes.baseline_mm);
  report.add("rectified", rectifier.changes_pictures() ? "by the calibration" : "as given");
  report_pairs(result.records, report);
  tell_of_rows(result.records, call.context);
  judge_pairs(result.records, options, call.context, report);
  write_pair_surface(result, eyes, options, call, report);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
