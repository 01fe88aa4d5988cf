// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/given_input.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "organbake/core/files.h"
#include "organbake/pipelines/content_hash.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

template <std::size_t N>
bool is_one_of(const std::string& text, const std::array<std::string_view, N>& list) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

bool is_volume_name(const fs::path& file) {
  constexpr std::array<std::string_view, 10> kEndings = {".nii", ".mha", ".mhd", ".nrrd", ".nhdr",
                                                         ".vti", ".dcm", ".ima", ".hdr",  ".img"};
  const std::string ending = lower_ending(file);
  const bool packed = ending == ".gz" || ending == ".bz2";
  return is_one_of(packed ? lower_ending(file.stem()) : ending, kEndings);
}

bool is_video_name(const fs::path& file) {
  constexpr std::array<std::string_view, 9> kEndings = {".mp4", ".m4v",  ".mkv", ".avi", ".mov",
                                                        ".wmv", ".webm", ".mpg", ".mpeg"};
  return is_one_of(lower_ending(file), kEndings);
}

}  // namespace

bool holds_frames(const fs::path& folder) {
  std::error_code ignored;
  const fs::directory_iterator files(folder, ignored);
  return std::any_of(begin(files), end(files),
                     [](const auto& entry) { return is_frame_name(entry.path()); });
}

GivenInput given_input(const fs::path& file) {
  if (fs::is_directory(file))
    return holds_frames(file) ? GivenInput{"a folder of frames", "frames"}
                              : GivenInput{"a folder", "ct"};
  if (is_mesh_name(file)) return {"a surface", "surface"};
  if (is_video_name(file)) return {"a video", "frames"};
  if (is_frame_name(file)) return {"a picture", "frames"};
  if (is_volume_name(file) || has_dicom_mark(file)) return {"a volume", "ct"};
  return {};
}

}  // namespace organbake
