// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/volume/dicom_slice.h"

namespace organbake {

struct DicomFolder {
  std::filesystem::path path;
  std::vector<DicomSlice> slices;   // in byte order of the file names
  std::vector<ScannedFile> others;  // DICOM files that are no image, or damaged
};

// Reads the headers of all files in a folder (of its subfolders only those that a DICOMDIR in it
// lists). Throws NoInputError when it
// is empty or holds no DICOM image, BadDataError when none of its DICOM files can be read.
DicomFolder scan_dicom_folder(const std::filesystem::path& folder);

// The images that one DICOM file stands for: the series beside it that it is a slice of, its own
// frames when it has several, or what it lists when it is a DICOMDIR.
DicomFolder scan_dicom_file_or_directory(const std::filesystem::path& file);

// "scout.dcm, report.dcm and 3 more": what a warning can name without filling the screen.
std::string named_files(const std::vector<std::filesystem::path>& files);

}  // namespace organbake
