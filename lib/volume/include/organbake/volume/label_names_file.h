// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
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

}  // namespace organbake
