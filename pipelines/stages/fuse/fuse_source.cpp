// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stages/fuse/fuse_source.h"

#include <cmath>
#include <filesystem>
#include <optional>

#include "core/error.h"
#include "core/files.h"
#include "formats/camera_files.h"
#include "formats/photo.h"
#include "image/exr.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// A depth map, and what lies beside it where `shade` and `stereo` put it.
struct DepthFile {
  fs::path depth;
  std::optional<fs::path> confidence, picture;
};

std::optional<fs::path> if_there(const fs::path& path) {
  return fs::is_regular_file(path) ? std::optional(path) : std::nullopt;
}

// A folder as the stages write it, or one of depth maps alone.
std::vector<DepthFile> files_in(const fs::path& folder) {
  const bool ours = fs::is_directory(folder / "depth");
  const fs::path depths = ours ? folder / "depth" : folder;
  std::vector<DepthFile> files;
  for (const fs::path& file : list_files(depths)) {
    if (lower_ending(file) != ".exr") continue;
    DepthFile found{depths / file, {}, {}};
    const std::string picture = file.stem().string() + ".png";
    if (ours) {
      found.confidence = if_there(folder / "confidence" / picture);
      found.picture = if_there(folder / "pictures" / picture);
    }
    files.push_back(std::move(found));
  }
  if (files.empty()) throw BadDataError(folder, "holds no depth map (EXR)");
  return files;
}

std::vector<DepthFile> depth_files(const StageCall& call) {
  std::vector<DepthFile> files;
  for (const auto& [name, path] : call.inputs_of("depth")) {
    if (!fs::is_directory(path)) {
      files.push_back({path, {}, {}});
      continue;
    }
    for (DepthFile& file : files_in(path)) files.push_back(std::move(file));
  }
  return files;
}

Plane read_depth(const fs::path& path, double mm_per_unit, const RunContext& context) {
  if (lower_ending(path) != ".exr") throw BadDataError(path, "is no depth map: an EXR is needed");
  const ChannelImage image = read_exr(path);
  const Channel* channel = nullptr;
  for (const char* name : {"Z", "Y", "depth", "depth.Z", "R"})
    if (!channel) channel = image.find(name);
  if (!channel || !std::holds_alternative<std::vector<float>>(channel->values))
    throw BadDataError(path, "has no channel Z or Y of depths");
  Plane depth(image.width, image.height);
  depth.values = channel->floats();
  std::size_t odd = 0;
  for (float& z : depth.values) {
    odd += std::isnan(z) || z < 0;
    z *= static_cast<float>(mm_per_unit);
  }
  if (odd > 0)
    context.warn(path.filename().string() + ": " + std::to_string(odd) +
                 " pixels are no number or negative; they count as holes");
  return depth;
}

Plane read_confidence(const fs::path& path) {
  const Rgb8Image image = read_photo(path);
  Plane confidence(image.width, image.height);
  for (std::size_t k = 0; k < confidence.size(); ++k)
    confidence.values[k] = static_cast<float>(image.pixels[3 * k]) / 255.F;
  return confidence;
}

// The camera whose image or name has the depth map's name; else, of as many cameras as depth maps,
// the one in its place.
std::size_t camera_of(const fs::path& depth, std::size_t at, std::size_t count,
                      const CameraSet& set, const fs::path& poses) {
  const std::string stem = depth.stem().string();
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    const std::string image = set.images.empty() ? "" : fs::path(set.images[i]).stem().string();
    if (image == stem || set.cameras[i].name == stem) return i;
  }
  if (set.cameras.size() != count)
    throw BadDataError(poses, "holds " + std::to_string(set.cameras.size()) + " cameras, none of " +
                                  "them named '" + stem + "', for " + std::to_string(count) +
                                  " depth maps; name the cameras as the depth maps, or give one "
                                  "for each in their order");
  return at;
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

void add_picture(const fs::path& path, const Intrinsics& lens, DepthView& view) {
  view.color = read_photo(path);
  view.color_lens = lens;
  if (view.color.width == lens.width && view.color.height == lens.height) return;
  throw BadDataError(path, "is " + std::to_string(view.color.width) + "x" +
                               std::to_string(view.color.height) + ", its camera " +
                               std::to_string(lens.width) + "x" + std::to_string(lens.height));
}

}  // namespace

std::vector<DepthView> read_depth_views(const StageCall& call, double mm_per_unit) {
  const fs::path& poses = *call.input("poses");
  const CameraSet set = read_camera_file(poses);
  const std::vector<DepthFile> files = depth_files(call);
  std::vector<DepthView> views;
  std::vector<bool> taken(set.cameras.size(), false);
  for (std::size_t i = 0; i < files.size(); ++i) {
    const DepthFile& file = files[i];
    const std::size_t at = camera_of(file.depth, i, files.size(), set, poses);
    if (taken[at])
      throw BadDataError(file.depth, "has the camera '" + set.cameras[at].name +
                                         "', as another depth map has; names must tell them apart");
    taken[at] = true;
    DepthView view;
    view.name = file.depth.string();
    view.camera = set.cameras[at];
    view.depth_mm = read_depth(file.depth, mm_per_unit, call.context);
    if (file.confidence) view.confidence = read_confidence(*file.confidence);
    Intrinsics straight = view.camera.intrinsics;
    straight.k1 = straight.k2 = straight.p1 = straight.p2 = straight.k3 = 0;
    const std::string image = set.images.empty() ? "" : set.images[at];
    if (const auto picture =
            picture_of(image, file.depth.stem().string(), call.input("pictures"), poses)) {
      add_picture(*picture, view.camera.intrinsics, view);
    } else if (file.picture) {
      add_picture(*file.picture, straight, view);
    }
    views.push_back(std::move(view));
  }
  return views;
}

}  // namespace organbake
