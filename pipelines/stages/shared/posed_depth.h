// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/run_context.h"
#include "organbake/image/exr.h"
#include "organbake/shading/grid.h"

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

// A depth map, and what lies beside it where `shade`, `stereo` and `motion` put it.
struct DepthFile {
  std::filesystem::path depth;
  std::optional<std::filesystem::path> confidence, picture;
};

// The path, where a file is there.
std::optional<std::filesystem::path> if_there(const std::filesystem::path& path);

// Those of a folder as the stages write it, or of one of depth maps alone, in the order of their
// names. Throws BadDataError for one without any.
std::vector<DepthFile> depth_files_in(const std::filesystem::path& folder);

struct DepthMap {
  Plane depth;  // as it is written
  ExrFacts facts;
  bool has_note(const char* note, const char* text) const;
};
// Says how many pixels are no depth at all. Throws NoInputError, BadDataError.
DepthMap read_depth_map(const std::filesystem::path& path, const RunContext& context);
Plane read_confidence(const std::filesystem::path& path);

}  // namespace organbake
