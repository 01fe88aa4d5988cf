// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/lighting.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/exr.h"
#include "organbake/image/png.h"
#include "organbake/image/video_pipe.h"
#include "organbake/phantom/phantom.h"
#include "organbake/pipelines/stage.h"
#include "organbake/volume/read_volume.h"
#include "stages/phantom/options.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// phantom.json: what a phantom was made with.
std::string phantom_json(const std::string& options_json) {
  return "{\"schema\": \"organbake/phantom/1\", \"options\": " + options_json + "}\n";
}

// The name that a frame's files bear: 000012.
std::string frame_number(int frame) {
  constexpr std::size_t kDigits = 6;
  return padded(static_cast<std::size_t>(frame), kDigits);
}

// What the frame shows, exactly, as EXR: depth (Z, and Y to look at), normals in camera axes, and
// the masks `highlight` and `instrument`.
void write_frame_truth(const std::filesystem::path& file, const LaparoscopyFrame& frame) {
  ChannelImage image{frame.depth_mm.width,
                     frame.depth_mm.height,
                     {{"Y", frame.depth_mm.values}, {"Z", frame.depth_mm.values}}};
  for (int c = 0; c < 3; ++c) {
    std::vector<float> values;
    for (const Eigen::Vector3f& normal : frame.normals) values.push_back(normal[c]);
    image.channels.push_back({std::string("normal.") + "XYZ"[c], std::move(values), true});
  }
  for (const auto& [name, mask] :
       {std::pair{"highlight", &frame.highlights}, std::pair{"instrument", &frame.instrument}})
    image.channels.push_back(
        {name, std::vector<float>(mask->values.begin(), mask->values.end()), true});
  write_exr(file, image, {.camera = frame.camera});
}

// The eyes of the first frame, whose places to each other all frames have.
void write_right_eye(const LaparoscopyPhantom& phantom, int frames, const StageCall& call) {
  const fs::path folder = call.output_folder / "right";
  make_folder(folder);
  for (int i = 0; i < frames; ++i) {
    call.context.throw_if_cancelled();
    write_png(folder / (frame_number(i) + ".png"), phantom.right_frame(i).image, 1);
  }
  CameraSet eyes;
  eyes.cameras = {phantom.camera(0), phantom.right_camera(0)};
  eyes.cameras[0].name = "left";
  eyes.cameras[1].name = "right";
  write_file_atomically(call.output_folder / "stereo.json", cameras_to_json(eyes));
}

void refuse_options_of_paths(const PhantomStageOptions& options) {
  if (options.clip.breathing_mm > 0 || options.clip.blurred > 0 || options.bit_rate_mbps > 0)
    throw UsageError(
        "path = sway: breathing, blurred and bit_rate belong to a clip along a path; choose one, "
        "such as --path tour, or leave them out");
}

// A scope that sways over a bed of bumps: frames/ is what `shade` reads, right/ and stereo.json
// what `stereo` reads besides; truth/ what they should find.
StageReport run_laparoscopy(const PhantomStageOptions& options, const StageCall& call) {
  refuse_options_of_paths(options);
  const LaparoscopyOptions asked = options.view();
  const LaparoscopyPhantom phantom(asked);
  const fs::path frames = call.output_folder / "frames", truth = call.output_folder / "truth";
  make_folder(frames);
  make_folder(truth);
  CameraSet set;
  for (int i = 0; i < asked.frames; ++i) {
    call.context.throw_if_cancelled();
    const LaparoscopyFrame frame = phantom.frame(i);
    write_png(frames / (frame_number(i) + ".png"), frame.image, 1);
    write_frame_truth(truth / (frame_number(i) + ".exr"), frame);
    set.cameras.push_back(frame.camera);
    call.context.progress((i + 1.0) / asked.frames);
  }
  if (asked.baseline_mm > 0) write_right_eye(phantom, asked.frames, call);
  write_file_atomically(call.output_folder / "cameras.json", cameras_to_json(set));
  write_file_atomically(call.output_folder / "phantom.json", phantom_json(call.options_json));
  StageReport report;
  report.add("frames", asked.frames);
  report.add("light_offset_mm", asked.light_offset_x_mm);
  return report;
}

constexpr int kTruthEvery = 5;   // frames
constexpr int kAtOnce = 4;       // frames that are drawn and written side by side
constexpr double kDrawn = 0.95;  // share of the work

// Where the frames go, in their order.
class FrameWriter {
 public:
  FrameWriter(const fs::path& folder, const LaparoscopyOptions& view, double bit_rate_mbps)
      : frames_(folder / "frames") {
    if (bit_rate_mbps == 0) {
      make_folder(frames_);
    } else {
      video_.emplace(folder / "clip.mp4", VideoFormat{view.width, view.height,
                                                      MovingClip::kFramesPerSecond, bit_rate_mbps});
    }
  }
  // Any number at once, in any order; what a video takes is kept until add().
  void write(int index, const Rgb8Image& image) const {
    if (!video_) write_png(frames_ / (frame_number(index) + ".png"), image, 1);
  }
  void add(const Rgb8Image& image) {
    if (video_) video_->add(image);
  }
  void finish() {
    if (video_) video_->finish();
  }

 private:
  fs::path frames_;
  std::optional<VideoPipe> video_;
};

std::string frames_csv(const MovingClip& clip, int frames) {
  std::string text = "frame,time_s,breath_mm,blur_px\n";
  for (int i = 0; i < frames; ++i)
    text += std::to_string(i) + "," + to_text(clip.time_s(i)) + "," + to_text(clip.breath_mm(i)) +
            "," + to_text(clip.blur_px(i)) + "\n";
  return text;
}

void write_frames(const MovingClip& clip, const LaparoscopyOptions& view, double bit_rate_mbps,
                  const StageCall& call) {
  FrameWriter writer(call.output_folder, view, bit_rate_mbps);
  for (int first = 0; first < view.frames; first += kAtOnce) {
    std::vector<Rgb8Image> images(std::min(kAtOnce, view.frames - first));
    parallel_for(std::size_t{0}, images.size(), [&](std::size_t i) {
      const int index = first + static_cast<int>(i);
      LaparoscopyFrame frame = clip.frame(index, call.context);
      writer.write(index, frame.image);
      if (index % kTruthEvery == 0)
        write_frame_truth(call.output_folder / "truth" / (frame_number(index) + ".exr"), frame);
      images[i] = std::move(frame.image);
    });
    for (const Rgb8Image& image : images) writer.add(image);
    call.context.progress(kDrawn * std::min(first + kAtOnce, view.frames) / view.frames);
  }
  writer.finish();
}

// A scope along a path: frames/, or clip.mp4 where a bit rate is asked for; cameras.json, a camera
// a frame; truth/: what every fifth frame shows, the surface whole and at rest, and frames.csv, the
// breath and the blur of each frame.
StageReport run_moving_clip(const PhantomStageOptions& options, const StageCall& call) {
  const MovingClipOptions asked = options.moving_clip();
  const MovingClip clip(asked);
  const fs::path truth = call.output_folder / "truth";
  make_folder(truth);
  write_frames(clip, asked.view, options.bit_rate_mbps, call);
  CameraSet set;
  for (int i = 0; i < asked.view.frames; ++i) set.cameras.push_back(clip.camera(i));
  write_file_atomically(call.output_folder / "cameras.json", cameras_to_json(set));
  write_file_atomically(truth / "frames.csv", frames_csv(clip, asked.view.frames));
  write_ply(truth / "surface.ply", clip.surface());
  write_file_atomically(call.output_folder / "phantom.json", phantom_json(call.options_json));
  StageReport report;
  report.add("frames", asked.view.frames);
  report.add("path", options.path);
  return report;
}

// Photographs go to their own folder with the cameras that took them.
void write_photos(const OrganPhantom& phantom, const fs::path& folder, const RunContext& context) {
  CameraSet set;
  set.cameras = phantom.photo_cameras();
  make_folder(folder);
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    context.throw_if_cancelled();
    set.images.push_back("photo_" + padded(i, 2) + ".png");
    write_png(folder / set.images.back(), phantom.photograph(set.cameras[i], context), 1);
    context.progress(0.4 + 0.6 * static_cast<double>(i + 1) / set.cameras.size());
  }
  write_file_atomically(folder / "cameras.json", cameras_to_json(set));
  write_file_atomically(folder / kLightingFile, lighting_to_json(studio_lighting()));
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<PhantomStageOptions>();
  if (options.kind == "laparoscopy")
    return options.moves_along_path() ? run_moving_clip(options, call)
                                      : run_laparoscopy(options, call);
  const OrganPhantom phantom(options.organ);
  const Volume ct = phantom.scan(call.context);
  call.context.progress(0.2);
  const TriangleMesh truth = phantom.surface(options.truth_subdivisions, call.context);
  call.context.progress(0.4);
  write_metaimage(call.output_folder / "ct.mha", ct);
  write_ply(call.output_folder / "truth.ply", truth);
  if (options.organ.photo_count > 0)
    write_photos(phantom, call.output_folder / "photos", call.context);
  write_file_atomically(call.output_folder / "phantom.json", phantom_json(call.options_json));
  StageReport report;
  report.add("voxels", ct.voxel_count());
  report.add("photos", options.organ.photo_count);
  report.add("truth_faces", truth.faces.size());
  report.add("truth_volume_ml", signed_volume(truth) / 1000);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
