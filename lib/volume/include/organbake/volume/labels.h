// SPDX-License-Identifier: GPL-3.0-or-later
// The labels of a mask: names, figures, boxes, and whether they fit their CT.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

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

}  // namespace organbake
