// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/dicom_folder.h"

#include <algorithm>
#include <iterator>

#include "dicom/dicom_directory.h"
#include "dicom/dicom_structure.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"

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

namespace {

DicomFolder scan_files(const fs::path& folder, std::vector<fs::path> files,
                       const std::string& hint) {
  if (files.empty()) throw NoInputError(folder, "holds no files" + hint);
  std::sort(files.begin(), files.end());
  std::vector<ScannedFile> scanned(files.size());
  parallel_for(std::size_t{0}, files.size(),
               [&](std::size_t i) { scanned[i] = scan_dicom_file(files[i]); });
  DicomFolder found;
  found.path = folder;
  for (ScannedFile& file : scanned) {
    if (file.slice) {
      found.slices.push_back(std::move(*file.slice));
      std::move(file.later_frames.begin(), file.later_frames.end(),
                std::back_inserter(found.slices));
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

}  // namespace

DicomFolder scan_dicom_folder(const fs::path& folder) {
  std::vector<fs::path> files;
  bool has_subfolders = false;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
    has_subfolders |= entry.is_directory();
  }
  // A disc keeps its images in subfolders, and a directory of them at its root.
  for (const fs::path& file : files) {
    if (is_dicom_directory(file)) return scan_dicom_file_or_directory(file);
  }
  return scan_files(folder, std::move(files),
                    has_subfolders ? "; give the subfolder that holds the CT series" : "");
}

DicomFolder scan_dicom_file_or_directory(const fs::path& file) {
  if (is_dicom_directory(file)) {
    const fs::path root = file.parent_path();
    std::vector<fs::path> files, missing;
    for (const fs::path& image : images_of_directory(file)) {
      const fs::path found = as_on_disc(root, image);
      (found.empty() ? missing : files).push_back(found.empty() ? root / image : found);
    }
    if (files.empty()) {
      throw NoInputError(file, "lists " + std::to_string(missing.size()) +
                                   " images, of which none is there; copy the whole disc");
    }
    DicomFolder folder = scan_files(file, std::move(files), "");
    for (const fs::path& path : missing) {
      folder.others.push_back({path, {}, {}, true, true, "is missing"});
    }
    return folder;
  }
  const ScannedFile scanned = scan_dicom_file(file);
  if (scanned.damaged || !scanned.slice) {
    throw BadDataError(file, scanned.damaged ? scanned.reason : "is a DICOM file without an image");
  }
  if (!scanned.later_frames.empty()) return scan_files(file, {file}, "");
  // One slice stands for its series, which lies beside it.
  DicomFolder folder = scan_dicom_folder(file.parent_path().empty() ? "." : file.parent_path());
  std::erase_if(folder.slices, [&](const DicomSlice& slice) {
    return slice.series_uid != scanned.slice->series_uid;
  });
  return folder;
}

}  // namespace organbake
