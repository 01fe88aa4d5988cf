// SPDX-License-Identifier: GPL-3.0-or-later
// Depth maps in folders, and the poses that belong to them by name or number.
#include "stages/shared/posed_depth.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/formats/photo.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Cameras = std::vector<std::optional<std::size_t>>;

std::string stem_of_image(const CameraSet& set, std::size_t at) {
  return set.images.empty() ? "" : fs::path(set.images[at]).stem().string();
}

Cameras by_name(const std::vector<fs::path>& maps, const CameraSet& set) {
  std::map<std::string, std::size_t> named;  // the first of a name
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    if (const std::string image = stem_of_image(set, i); !image.empty()) named.emplace(image, i);
    named.emplace(set.cameras[i].name, i);
  }
  Cameras found;
  for (const fs::path& map : maps) {
    const auto at = named.find(map.stem().string());
    found.push_back(at == named.end() ? std::nullopt : std::optional(at->second));
  }
  return found;
}

// The last digits of a name, without the noughts before them; "" where it has none.
std::string number_in(const std::string& name) {
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  const auto last = std::find_if(name.rbegin(), name.rend(), is_digit);
  const auto first = std::find_if_not(last, name.rend(), is_digit);
  const std::string digits(first.base(), last.base());
  if (digits.empty()) return digits;
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size() - 1));
}

// Nothing at all where two cameras have one number.
Cameras by_number(const std::vector<fs::path>& maps, const CameraSet& set) {
  std::map<std::string, std::size_t> numbered;
  Cameras found(maps.size());
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    const std::string image = stem_of_image(set, i);
    const std::string number = number_in(image.empty() ? set.cameras[i].name : image);
    if (!number.empty() && !numbered.emplace(number, i).second) return found;
  }
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const auto at = numbered.find(number_in(maps[i].stem().string()));
    if (at != numbered.end()) found[i] = at->second;
  }
  return found;
}

bool any(const Cameras& cameras) {
  return std::any_of(cameras.begin(), cameras.end(), [](const auto& at) { return at.has_value(); });
}

bool all(const Cameras& cameras) {
  return std::all_of(cameras.begin(), cameras.end(), [](const auto& at) { return at.has_value(); });
}

std::string example_of(const Cameras& cameras, const std::vector<fs::path>& maps,
                       const CameraSet& set, const fs::path& poses) {
  for (std::size_t i = 0; i < maps.size(); ++i) {
    if (!cameras[i]) continue;
    const std::string image = stem_of_image(set, *cameras[i]);
    return maps[i].stem().string() + " is " +
           (image.empty() ? set.cameras[*cameras[i]].name : image);
  }
  throw BadDataError(poses, "holds " + std::to_string(set.cameras.size()) +
                                " cameras, none of them named '" + maps.front().stem().string() +
                                "', for " + std::to_string(maps.size()) +
                                " depth maps; name the cameras as the depth maps, or give one for "
                                "each in their order");
}

void check_each_once(const Cameras& cameras, const std::vector<fs::path>& maps,
                     const CameraSet& set) {
  std::vector<bool> taken(set.cameras.size(), false);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (!cameras[i]) continue;
    if (taken[*cameras[i]])
      throw BadDataError(maps[i], "has the camera '" + set.cameras[*cameras[i]].name +
                                      "', as another depth map has; names must tell them apart");
    taken[*cameras[i]] = true;
  }
}

}  // namespace

MatchedPoses match_poses(const std::vector<fs::path>& maps, const CameraSet& set,
                         const fs::path& poses) {
  MatchedPoses matched{by_name(maps, set), ""};
  if (!any(matched.camera)) {
    const Cameras numbered = by_number(maps, set);
    if (set.cameras.size() == maps.size() && !all(numbered)) {
      for (std::size_t i = 0; i < maps.size(); ++i) matched.camera[i] = i;
    } else {
      matched.camera = numbered;
      matched.by_number = example_of(numbered, maps, set, poses);
    }
  }
  check_each_once(matched.camera, maps, set);
  return matched;
}

std::optional<fs::path> if_there(const fs::path& path) {
  return fs::is_regular_file(path) ? std::optional(path) : std::nullopt;
}

std::vector<DepthFile> depth_files_in(const fs::path& folder) {
  const bool ours = fs::is_directory(folder / "depth");
  const fs::path depths = ours ? folder / "depth" : folder;
  std::vector<DepthFile> files;
  for (const fs::path& file : list_numbered_files(depths)) {
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
