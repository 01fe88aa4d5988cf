// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"

// OpenEXR files, read with a check of all that they say and written by several threads.

namespace organbake {

// Reads half, float and uint channels of a single-part file. Throws NoInputError, or BadDataError
// for anything damaged, deep, tiled, multi-part, compressed by RLE or B44, or larger than
// max_pixels or than its bytes can hold (checked before memory is taken). Missing channels are the
// caller's to find. `only`: the channels that are wanted; none named = all. Spreads over TBB's
// threads.
ChannelImage read_exr(const std::filesystem::path& path, std::size_t max_pixels = 1u << 28);
ChannelImage parse_exr(std::span<const std::byte> bytes, const std::string& name,
                       std::size_t max_pixels = 1u << 28,
                       const std::vector<std::string>& only = {});

// What a file says of its pixels besides their values.
struct ExrFacts {
  // As write_exr() puts it; nothing for matrices of other axes than ours. To seven digits.
  std::optional<PosedCamera> camera;
  std::map<std::string, std::string> notes;
};
// Throws BadDataError as parse_exr() does.
ExrFacts parse_exr_facts(std::span<const std::byte> bytes, const std::string& name,
                         std::size_t max_pixels = 1u << 28);

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

// What a depth map of a frame says of itself (ExrWriteOptions::notes), for who brings it together
// with poses from elsewhere.
inline constexpr const char* kDepthUnitNote = "depthUnit";
inline constexpr const char* kRelativeDepth = "relative";  // of this map alone; else mm
inline constexpr const char* kLensNote = "lens";
inline constexpr const char* kAssumedLens = "assumed";  // a field of view nobody measured
inline constexpr const char* kWorldNote = "world";
inline constexpr const char* kScopesOwnAxes = "scope";  // camera_from_world begins at the scope

}  // namespace organbake
