// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/volume/volume.h"

namespace organbake {

// Of a NIfTI affine whose steps are 1 mm where the header tells other voxel sizes besides.
enum class UnitAffine { refuse, keep, scale };

struct VolumeReadOptions {
  std::string series = {};  // of a DICOM folder: UID or number; empty = the one that is a CT volume
  // Refuse what would have to be mended: uneven gaps, missing, repeated or damaged slices.
  bool strict = false;
  // Only the voxels round this box of the world are kept, and only the slices that they need are
  // read.
  std::optional<Region> region = {};
  // Only where the voxels lie is asked for: a reader that can leaves their values out.
  bool grid_only = false;
  int time = 0;            // which of several time points, from 1; 0 = there must be only one
  bool any_time = false;   // without `time`, the first of several stands for all: for a look
  bool lasting = false;    // a volume of one time point alone stands for any `time`
  std::string label = {};  // of a mask: a number, a name, or several; empty = all as they are
  std::vector<LabelName> label_names = {};  // of a mask, instead of its file's own
  bool is_mask = false;                     // its values are labels: never interpolated
  // Of DICOM masks: the scan that they were made on, whose slices tell how thick their planes are.
  // Contours that follow its voxels become these.
  const Volume* scan = nullptr;
  UnitAffine unit_affine = UnitAffine::refuse;
  bool only_channels = false;  // of a mask of several volumes: they are no times, its CT has none
};

// Reads NIfTI (.nii, .nii.gz; RAS converted to LPS here, once), MetaImage (.mha, .mhd), NRRD
// (.nrrd, .nhdr), VTI, or a folder or zip holding a DICOM CT series. The kind is told by content
// and ending. Throws NoInputError (missing, empty folder, folder without DICOM), BadDataError, or
// UsageError when a series is asked for that only a DICOM folder could have.
Volume read_volume(const std::filesystem::path& path, const VolumeReadOptions& options,
                   const RunContext& context = {});
Volume read_volume(const std::filesystem::path& path, const RunContext& context = {});

// What a DICOM folder holds, whether or not one of its series is a CT volume: a line for every
// series and for every file without an image. Throws as read_volume() does for a folder.
struct DicomContents {
  std::vector<std::string> series, other_files;
};
DicomContents dicom_contents(const std::filesystem::path& folder);

// Whether a folder holds masks, one file each, called as their labels are (TotalSegmentator writes
// "liver.nii.gz"), and nothing of DICOM. read_volume() takes it as one mask of these names.
bool is_folder_of_masks(const std::filesystem::path& path);

// MetaImage (.mha), int16, zlib-compressed, deterministic bytes. Throws IoError.
void write_metaimage(const std::filesystem::path& path, const Volume& volume);

}  // namespace organbake
