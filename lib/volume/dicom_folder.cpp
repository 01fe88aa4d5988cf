// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/dicom_folder.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/error.h"

namespace organbake {

namespace fs = std::filesystem;

std::string named_files(const std::vector<fs::path>& files) {
  constexpr std::size_t kNamed = 4;
  std::string names;
  for (std::size_t i = 0; i < std::min(files.size(), kNamed); ++i) {
    names += (i ? ", " : "") + files[i].filename().string();
  }
  if (files.size() > kNamed) names += " and " + std::to_string(files.size() - kNamed) + " more";
  return names;
}

DicomFolder scan_dicom_folder(const fs::path& folder) {
  std::vector<fs::path> files;
  bool has_subfolders = false;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
    has_subfolders |= entry.is_directory();
  }
  const std::string hint = has_subfolders ? "; give the subfolder that holds the CT series" : "";
  if (files.empty()) throw NoInputError(folder, "holds no files" + hint);
  std::sort(files.begin(), files.end());
  std::vector<ScannedFile> scanned(files.size());
  tbb::parallel_for(std::size_t{0}, files.size(),
                    [&](std::size_t i) { scanned[i] = scan_dicom_file(files[i]); });
  DicomFolder found;
  found.path = folder;
  for (ScannedFile& file : scanned) {
    if (file.slice) {
      found.slices.push_back(std::move(*file.slice));
    } else if (file.is_dicom) {
      found.others.push_back(std::move(file));
    }
  }
  if (!found.slices.empty()) return found;
  for (const ScannedFile& file : found.others) {
    if (!file.damaged) continue;
    throw BadDataError(folder, "none of its DICOM files can be read, copy the series again; " +
                                   file.file.filename().string() + ": " + file.reason);
  }
  std::vector<fs::path> no_images;
  for (const ScannedFile& file : found.others) no_images.push_back(file.file);
  const std::string which = no_images.empty() ? "" : " (" + named_files(no_images) + ": no image)";
  throw NoInputError(folder, "holds no DICOM image among its " + std::to_string(files.size()) +
                                 " files" + which + hint);
}

}  // namespace organbake
