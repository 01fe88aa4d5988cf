// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// Exact, but for two: pxr24 drops 8 bits of each float (halves and uints stay), dwaa is lossy as
// JPEG is, on channels named R, G, B and Y: for colour only, never for depth.
enum class ExrCompression { none, zip, piz, pxr24, dwaa };

struct ExrWriteOptions {
  ExrCompression compression = ExrCompression::zip;
  int zip_level = 6;  // 1…12, of zip and pxr24; higher is smaller and slower
  // Written as worldToCamera and worldToNDC (Imath row-vector matrices, mm, +z forward, y down).
  std::optional<PosedCamera> camera = {};
  std::map<std::string, std::string> notes = {};  // attributes that are texts, by their names
};

// Single-part scan-line EXR, deterministic bytes, one thread (write images in parallel instead).
// Throws IoError.
void write_exr(const std::filesystem::path& path, const ChannelImage& image,
               const ExrWriteOptions& options = {});

}  // namespace organbake
