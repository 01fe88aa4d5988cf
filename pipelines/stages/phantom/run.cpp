// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/phantom/phantom.h"

#include <filesystem>

#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/lighting.h"
#include "organbake/core/files.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/png.h"
#include "organbake/pipelines/stage_binding.h"
#include "organbake/pipelines/stage_module.h"
#include "organbake/volume/write_volume.h"
#include "stages/phantom/clip_files.h"
#include "stages/phantom/options.h"
#include "stages/phantom/run_laparoscopy.h"
#include "stages/phantom/run_moving_clip.h"

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

StageReport run(const StageCall& call) {
  const auto options = call.options_as<PhantomStageOptions>();
  if (options.kind == "laparoscopy")
    return options.moves_along_path() ? run_moving_clip(options, call)
                                      : run_laparoscopy(options, call);
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
