// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

namespace organbake {

// Why the data elements of a DICOM file do not hold together (PS3.5, 7): one that reaches beyond
// what it is in, a sequence that is no list of items, nesting without end; empty when they do.
// Looked at before vtk-dicom's parser sees the file, which reads past the end of a sequence that is
// cut off, and takes memory for lengths before it finds them to be lies. Of the pixel data only
// fragments are looked at.
std::string flaw_of_dicom(const std::filesystem::path& file);

}  // namespace organbake
