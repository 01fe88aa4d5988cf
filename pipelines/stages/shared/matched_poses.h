// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"

namespace organbake {

struct MatchedPoses {
  std::vector<std::optional<std::size_t>> camera;  // of each map; nothing: it has no pose
  std::string by_number;  // an example, where numbers alone told which belongs to which
};

// The cameras of depth maps: the one whose image or name is the map's; where that finds none, the
// one whose image ends in the same number (frame_0040 and 000040); of as many cameras as maps,
// unless all have the same numbers, the one in its place. Throws BadDataError naming `poses` when
// no map has a camera, and for a camera that two maps would have.
MatchedPoses match_poses(const std::vector<std::filesystem::path>& maps, const CameraSet& set,
                         const std::filesystem::path& poses);

}  // namespace organbake
