// SPDX-License-Identifier: GPL-3.0-or-later
#include "phantom/phantom.h"

#include <filesystem>

#include "bundle/cameras_json.h"
#include "bundle/lighting.h"
#include "core/files.h"
#include "core/text.h"
#include "geometry/ply.h"
#include "image/exr.h"
#include "image/png.h"
#include "pipelines/stage_binding.h"
#include "pipelines/stage_module.h"
#include "pipelines/stages/phantom/options.h"
#include "volume/write_volume.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

std::string photo_name(std::size_t index) {
  const std::string number = std::to_string(index);
  return "photo_" + std::string(number.size() < 2 ? 2 - number.size() : 0, '0') + number + ".png";
}

// Photographs go to their own folder with the cameras that took them.
void write_photos(const OrganPhantom& phantom, const fs::path& folder, const RunContext& context) {
  CameraSet set;
  set.cameras = phantom.photo_cameras();
  make_folder(folder);
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    context.throw_if_cancelled();
    set.images.push_back(photo_name(i));
    write_png(folder / set.images.back(), phantom.photograph(set.cameras[i], context), 1);
    context.progress(0.4 + 0.6 * static_cast<double>(i + 1) / set.cameras.size());
  }
  write_file_atomically(folder / "cameras.json", cameras_to_json(set));
  write_file_atomically(folder / kLightingFile, lighting_to_json(studio_lighting()));
}

std::string phantom_json(const std::string& options_json) {
  return "{\"schema\": \"organbake/phantom/1\", \"options\": " + options_json + "}\n";
}

// right/ and stereo.json are what `stereo` reads besides frames/: the eyes of the first frame,
// whose places to each other all frames have.
void write_right_eye(const LaparoscopyPhantom& phantom, int frames, const StageCall& call) {
  const fs::path folder = call.output_folder / "right";
  make_folder(folder);
  for (int i = 0; i < frames; ++i) {
    call.context.throw_if_cancelled();
    write_png(folder / (padded(static_cast<std::size_t>(i), 6) + ".png"),
              phantom.right_frame(i).image, 1);
  }
  CameraSet eyes;
  eyes.cameras = {phantom.camera(0), phantom.right_camera(0)};
  eyes.cameras[0].name = "left";
  eyes.cameras[1].name = "right";
  write_file_atomically(call.output_folder / "stereo.json", cameras_to_json(eyes));
}

// frames/ is what `shade` reads; truth/ what it should find.
StageReport run_laparoscopy(const PhantomStageOptions& options, const StageCall& call) {
  LaparoscopyOptions asked = options.laparoscopy;
  asked.seed = options.organ.seed;
  const LaparoscopyPhantom phantom(asked);
  const fs::path frames = call.output_folder / "frames", truth = call.output_folder / "truth";
  make_folder(frames);
  make_folder(truth);
  constexpr std::size_t kDigits = 6;
  CameraSet set;
  for (int i = 0; i < asked.frames; ++i) {
    call.context.throw_if_cancelled();
    const LaparoscopyFrame frame = phantom.frame(i);
    const std::string name = padded(static_cast<std::size_t>(i), kDigits);
    write_png(frames / (name + ".png"), frame.image, 1);
    ChannelImage image{
        asked.width, asked.height, {{"Y", frame.depth_mm.values}, {"Z", frame.depth_mm.values}}};
    for (int c = 0; c < 3; ++c) {
      std::vector<float> values;
      for (const Eigen::Vector3f& normal : frame.normals) values.push_back(normal[c]);
      image.channels.push_back({std::string("normal.") + "XYZ"[c], std::move(values), true});
    }
    for (const auto& [name, mask] :
         {std::pair{"highlight", &frame.highlights}, std::pair{"instrument", &frame.instrument}})
      image.channels.push_back(
          {name, std::vector<float>(mask->values.begin(), mask->values.end()), true});
    write_exr(truth / (name + ".exr"), image, {.camera = frame.camera});
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

StageReport run(const StageCall& call) {
  const auto options = resolved_options<PhantomStageOptions>(call.options_json);
  if (options.kind == "laparoscopy") return run_laparoscopy(options, call);
  options.organ.check();
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
