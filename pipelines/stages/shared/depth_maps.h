// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/image/exr.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A depth map, and what lies beside it where `shade`, `stereo` and `motion` put it.
struct DepthFile {
  std::filesystem::path depth;
  std::optional<std::filesystem::path> confidence, picture;
};

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
