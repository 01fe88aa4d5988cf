// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/fuse/fuse_source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/photo.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/image/depth_notes.h"
#include "stages/shared/depth_maps.h"
#include "stages/shared/matched_poses.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> if_there(const fs::path& path) {
  return fs::is_regular_file(path) ? std::optional(path) : std::nullopt;
}

std::vector<DepthFile> depth_files(const StageCall& call) {
  std::vector<DepthFile> files;
  for (const auto& [name, path] : call.inputs_of("depth")) {
    if (!fs::is_directory(path)) {
      files.push_back({path, {}, {}});
      continue;
    }
    for (DepthFile& file : depth_files_in(path)) files.push_back(std::move(file));
  }
  return files;
}

// In the folder that was given, or beside the document.
std::optional<fs::path> picture_of(const std::string& image, const std::string& stem,
                                   const fs::path* folder, const fs::path& poses) {
  if (!folder) return image.empty() ? std::nullopt : if_there(poses.parent_path() / image);
  if (!image.empty())
    if (auto found = if_there(*folder / fs::path(image).filename())) return found;
  for (const char* ending : {".png", ".jpg", ".jpeg"})
    if (auto found = if_there(*folder / (stem + ending))) return found;
  return std::nullopt;
}

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

// The lens of the pixels of a map or a picture: the camera's, at whatever size.
Intrinsics lens_at_size(const fs::path& path, const Intrinsics& lens, int width, int height) {
  if (is_scaled_picture(lens, width, height)) return scaled_lens(lens, width, height);
  throw BadDataError(path, "is " + size_text(width, height) + ", its camera " +
                               size_text(lens.width, lens.height) +
                               "; they must be of one size, or one the other's made smaller");
}

void add_picture(const fs::path& path, const Intrinsics& lens, DepthView& view) {
  view.color = read_photo(path);
  view.color_lens = lens_at_size(path, lens, view.color.width, view.color.height);
}

// What the map says of its own camera goes before the lens of the poses, which may have been
// straightened or rectified for it. A lens that was assumed says nothing.
void set_camera(const fs::path& path, const PosedCamera& posed, const DepthMap& map,
                const RunContext& context, DepthView& view) {
  const int width = map.depth.width, height = map.depth.height;
  view.camera = posed;
  const bool own = map.facts.camera && map.has_note(kWorldNote, kScopesOwnAxes) &&
                   !map.has_note(kLensNote, kAssumedLens);
  if (!own) {
    view.camera.intrinsics = lens_at_size(path, pinhole_of(posed.intrinsics), width, height);
    if (map.has_note(kLensNote, kAssumedLens))
      context.warn(path.filename().string() +
                   " was made without a lens, with a field of view that was assumed; the poses' "
                   "lens is taken for it here, but give it to shade as well (--intrinsics)");
    return;
  }
  view.camera.intrinsics = map.facts.camera->intrinsics;
  // How stereo's left eye was turned to be rectified; its own cameras.json has that already.
  const auto turn = written_rotation(map.facts.camera->camera_from_world.rotation);
  constexpr double kSevenDigits = 1e-5;
  if (!turn || turn->isApprox(posed.camera_from_world.rotation, kSevenDigits)) return;
  view.camera.camera_from_world = RigidTransform{*turn, {0, 0, 0}} * posed.camera_from_world;
  view.color_from_camera = turn->transpose();
}

DepthView read_view(const StageCall& call, const DepthFile& file, const CameraSet& set,
                    std::size_t at, double mm_per_unit) {
  DepthMap map = read_depth_map(file.depth, call.context);
  DepthView view;
  view.name = file.depth.string();
  view.relative = map.has_note(kDepthUnitNote, kRelativeDepth);
  set_camera(file.depth, set.cameras[at], map, call.context, view);
  view.depth_mm = std::move(map.depth);
  if (!view.relative && mm_per_unit != 1)
    for (float& z : view.depth_mm.values) z *= static_cast<float>(mm_per_unit);
  if (file.confidence) view.confidence = read_confidence(*file.confidence);
  const std::string image = set.images.empty() ? "" : set.images[at];
  if (const auto picture = picture_of(image, file.depth.stem().string(), call.input("pictures"),
                                      *call.input("poses"))) {
    add_picture(*picture, set.cameras[at].intrinsics, view);
  } else if (file.picture) {
    view.color_from_camera.setIdentity();
    add_picture(*file.picture, view.camera.intrinsics, view);
  }
  return view;
}

}  // namespace

DepthViews read_depth_views(const StageCall& call, double mm_per_unit) {
  const fs::path& poses = *call.input("poses");
  const CameraSet set = read_camera_file(poses, call.context);
  const std::vector<DepthFile> files = depth_files(call);
  std::vector<fs::path> maps;
  for (const DepthFile& file : files) maps.push_back(file.depth);
  const MatchedPoses matched = match_poses(maps, set, poses);
  DepthViews result;
  result.by_number = matched.by_number;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (matched.camera[i]) {
      result.views.push_back(read_view(call, files[i], set, *matched.camera[i], mm_per_unit));
    } else {
      result.without_pose.push_back(files[i].depth.filename().string());
    }
  }
  return result;
}

}  // namespace organbake
