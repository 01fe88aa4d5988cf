// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/shared/depth_maps.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/formats/photo.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> if_found(const fs::path& path) {
  return fs::is_regular_file(path) ? std::optional(path) : std::nullopt;
}

}  // namespace

std::vector<DepthFile> depth_files_in(const fs::path& folder) {
  const bool ours = fs::is_directory(folder / "depth");
  const fs::path depths = ours ? folder / "depth" : folder;
  std::vector<DepthFile> files;
  for (const fs::path& file : list_numbered_files(depths)) {
    if (lower_ending(file) != ".exr") continue;
    DepthFile found{depths / file, {}, {}};
    const std::string picture = file.stem().string() + ".png";
    if (ours) {
      found.confidence = if_found(folder / "confidence" / picture);
      found.picture = if_found(folder / "pictures" / picture);
    }
    files.push_back(std::move(found));
  }
  if (files.empty()) throw BadDataError(folder, "holds no depth map (EXR)");
  return files;
}

DepthMap read_depth_map(const fs::path& path, const RunContext& context) {
  if (lower_ending(path) != ".exr") throw BadDataError(path, "is no depth map: an EXR is needed");
  const std::vector<std::byte> bytes = read_file(path);
  const ChannelImage image = parse_exr(bytes, path.string());
  const Channel* channel = nullptr;
  for (const char* name : {"Z", "Y", "depth", "depth.Z", "R"})
    if (!channel) channel = image.find(name);
  if (!channel || !std::holds_alternative<std::vector<float>>(channel->values))
    throw BadDataError(path, "has no channel Z or Y of depths");
  DepthMap map{Plane(image.width, image.height), parse_exr_facts(bytes, path.string())};
  map.depth.values = channel->floats();
  const auto odd = std::count_if(map.depth.values.begin(), map.depth.values.end(),
                                 [](float z) { return std::isnan(z) || z < 0; });
  if (odd > 0)
    context.warn(path.filename().string() + ": " + std::to_string(odd) +
                 " pixels are no number or negative; they count as holes");
  return map;
}

bool DepthMap::has_note(const char* note, const char* text) const {
  const auto found = facts.notes.find(note);
  return found != facts.notes.end() && found->second == text;
}

Plane read_confidence(const fs::path& path) {
  const Rgb8Image image = read_photo(path);
  Plane confidence(image.width, image.height);
  for (std::size_t k = 0; k < confidence.size(); ++k)
    confidence.values[k] = static_cast<float>(image.pixels[3 * k]) / 255.F;
  return confidence;
}

}  // namespace organbake
