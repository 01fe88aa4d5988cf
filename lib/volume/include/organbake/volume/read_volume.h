// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Volumes out of files, and the labels of a mask: names, figures, boxes, and whether they fit their
// CT.

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/volume/volume.h"

namespace organbake {

// Names of labels from a text of a label a line: ITK-SNAP's label descriptions (number, red, green,
// blue, three more, "name") and 3D Slicer's colour tables (number, name, red, green, blue,
// opacity), or a number and a name; or a table whose columns semicolons or commas part, quoted or
// not, with titles or without: of several texts the longest is the name. Lines that begin with '#'
// are comments, label 0 is the background. Or from nnU-Net's dataset.json, whose "labels" are
// {"liver": 1}, or {"1": "liver"} in its first version; a region has several, {"kidney": [1, 2]}.
// Throws NoInputError, and BadDataError naming the line, or the label, that is none of these.
std::vector<LabelName> read_label_names(const std::filesystem::path& file);

// "1 spleen, 5 liver": what messages can name without filling the screen.
std::string label_list(const std::vector<LabelName>& names);

// "liver", or "label 5" where it has no name.
std::string name_of_label(const Volume& mask, int label);

// Throws BadDataError: "the mask has no label 7; it holds 1 spleen, 2, 5".
[[noreturn]] void throw_label_absent(const Volume& mask, int label);

// One label of a mask: what a person chooses by.
struct LabelFigures {
  int label = 0;
  std::string name;  // empty when the file has none
  std::size_t voxels = 0;
  double volume_ml = 0;
  Eigen::Vector3d min_mm = Eigen::Vector3d::Zero();  // box of its voxels' centres, LPS
  Eigen::Vector3d max_mm = Eigen::Vector3d::Zero();
};

// Few values, none below 0, or named ones: labels, and no CT.
bool looks_like_mask(const Volume& volume);

// Every label that voxels have, in increasing order, without the background 0.
std::vector<LabelFigures> label_figures(const Volume& mask);

// "5 liver: 1043.1 ml, 38634 voxels, (…, …, …)…(…, …, …) mm"
std::string label_line(const LabelFigures& figures);

// The smallest box of voxels that holds a label.
struct LabelBox : IndexBox {
  std::size_t label_voxels = 0;  // 0 when the label is absent
};
LabelBox bounding_box(const Volume& mask, int label);

// The box of the world that holds a label's voxels with those around them, and what lies one voxel
// beyond: all of a scan that is asked about the label.
Region region_around(const Volume& mask, const LabelBox& box);

// How well a label sits on the tissue that it claims to mark.
struct MaskFit {
  double soft_tissue_share = 0;  // 0…1
  double mean_hu = 0;
  double deviation_hu = 0;
};

// A place along the CT's slice axis where the label fits far better.
struct BetterPlace {
  int slices = 0;                    // CT slices to move the mask by, along +k
  Eigen::Vector3d shift_world_mm{};  // the same in the world: add it to the mask's origin_mm
  MaskFit fit;
};

struct MaskCheck {
  bool grids_equal = false;
  double overlap_share = 0;  // of the label's voxels that lie inside the CT
  MaskFit fit;
  std::optional<BetterPlace>
      better;  // searched for when the fit is not plausible and the grids differ
  bool plausible = false;
  std::string message;  // one or two sentences for the user; empty when all is well
};

// Tells whether a mask looks misplaced on its CT. A wrong header (a crop that kept the origin of
// the whole scan, say) is legal data: only the tissue below the label gives it away. The search for
// a better place slides the label along the slices and takes the smallest standard deviation, which
// a homogeneous organ shows only in its true place, and which must suit most of the mask's
// other labels, if any fit where they are. Throws BadDataError when the label is absent.
MaskCheck check_mask(const Volume& ct, const Volume& mask, int label);

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
