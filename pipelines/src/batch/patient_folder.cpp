// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/patient_folder.h"

#include <algorithm>

#include "bake/given_input.h"
#include "organbake/core/error.h"
#include "organbake/pipelines/content_hash.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepest = 3;

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (!entry.path().filename().string().starts_with(".")) entries.push_back(entry.path());
  std::sort(entries.begin(), entries.end());
  return entries;
}

// One series, or several: which one is to be baked the reader asks.
bool holds_slices(const std::vector<fs::path>& entries) {
  return std::any_of(entries.begin(), entries.end(), [](const fs::path& entry) {
    return fs::is_regular_file(entry) && has_dicom_mark(entry);
  });
}

void look_into(const fs::path& folder, int depth, std::vector<FoundInput>& found) {
  const std::vector<fs::path> entries = sorted_entries(folder);
  if (fs::exists(folder / "manifest.json")) return;  // a bundle
  if (holds_slices(entries)) return found.push_back({"ct", folder});
  if (holds_frames(folder)) return found.push_back({"frames", folder});
  for (const fs::path& entry : entries) {
    if (fs::is_directory(entry)) {
      if (depth < kDeepest) look_into(entry, depth + 1, found);
    } else if (const std::string input = given_input(entry).input; !input.empty()) {
      found.push_back({input, entry});
    }
  }
}

}  // namespace

std::vector<FoundInput> inputs_in(const fs::path& folder) {
  if (!fs::exists(folder)) throw NoInputError(folder, "there is no such file or folder");
  std::vector<FoundInput> found;
  if (fs::is_directory(folder)) {
    look_into(folder, 0, found);
  } else if (const std::string input = given_input(folder).input; !input.empty()) {
    found.push_back({input, folder});
  }
  if (found.empty())
    throw NoInputError(folder,
                       "holds no scan, clip or surface that organbake knows; name the folder of a "
                       "patient's DICOM slices, NIfTI files, videos or meshes");
  return found;
}

}  // namespace organbake
