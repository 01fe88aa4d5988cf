// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/shared/albedo_output.h"

#include <utility>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/files.h"
#include "organbake/image/png.h"
#include "organbake/shading/frame_albedo.h"

namespace organbake {

Rgb8Image write_albedo(const std::filesystem::path& folder, const PreparedFrame& frame,
                       const FrameDepth& depth, const LaparoscopeOptions& lamp, double mm_per_unit,
                       StageReport& report) {
  FrameAlbedo albedo = divide_light_out(frame, depth, lamp, mm_per_unit);
  write_png(folder / "albedo.png", albedo.color);
  write_file_atomically(folder / kLightingFile, lighting_to_json(laparoscope_lighting(lamp)));
  report.add("albedo_reference_mm", albedo.reference_mm);
  report.add("falloff_in_frame", albedo.falloff_before);
  report.add("falloff_in_albedo", albedo.falloff_left);
  report.add("cosine_in_frame", albedo.cosine_before);
  report.add("cosine_in_albedo", albedo.cosine_left);
  return std::move(albedo.color);
}

void write_scope_photo(const std::filesystem::path& folder, const Rgb8Image& picture,
                       const Intrinsics& camera) {
  const CameraSet set{{{"scope", camera, {}}}, {"picture.png"}, {}};
  make_folder(folder / "photo");
  write_png(folder / "photo/picture.png", picture);
  write_file_atomically(folder / kScopePhotoFile, cameras_to_json(set));
}

}  // namespace organbake
