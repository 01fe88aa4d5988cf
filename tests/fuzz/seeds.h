// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Small sound files of volumes and masks, as scanners, archives and programs write them: what
// damage begins with.

#include <cstdint>
#include <string>
#include <vector>

#include "fuzz/readers.h"

class vtkXMLWriter;

namespace organbake {

// The writer's input as VTK writes it: as text, as base64, appended; packed or not; in both orders
// of bytes; with short and with long counts.
Seeds vtk_writings(vtkXMLWriter& writer);

// The same packed as is not read.
std::string vtk_lz4_writing(vtkXMLWriter& writer);

// Small volumes as the programs of the field write them: every kind of number, order of bytes,
// packing and placement that a format has.
Seeds nifti_seeds();
Seeds zipped_nifti_seeds();
Seeds nrrd_seeds();
Seeds layered_mask_seeds();  // of NRRD
Seeds metaimage_seeds();
Seeds vti_seeds();
Seeds detached_volume_seeds();

// What these formats can hold and is not read: complex numbers, several values a voxel, LZ4.
Seeds refused_niftis();
Seeds refused_zipped_niftis();
Seeds refused_vtis();

// Explicit little-endian files in other transfer syntaxes. As old archives hold it: implicit
// little-endian. With `open`, sequences and their items do not tell their length but end with a
// mark.
std::string as_implicit(const std::string& file, bool open = false);

// Deflated (PS3.5, A.5).
std::string as_deflated(const std::string& file);

// Pixels of 16 bits, `side` by `side`, as a codestream by GDCM's encoders; empty where it has none.
std::string codestream_in(const std::string& syntax, const std::vector<std::uint16_t>& pixels,
                          int side);

// Small files and folders as scanners, archives and planning systems write them.
Seeds dicom_image_seeds();   // several frames in one file
Seeds dicom_series_seeds();  // the files of a folder as parts of one input
Seeds zipped_dicom_seeds();
Seeds dicom_segmentation_seeds();
Seeds dicom_contour_seeds();

// What DICOM holds besides CT volumes: a slice alone, other pictures, half a disc.
Seeds refused_dicom_images();
Seeds refused_dicom_series();
Seeds refused_dicom_zips();

// A codestream's kind by any number, then by GDCM's own encoders one of each kind: its first byte
// says which.
std::string codestream_syntax(unsigned which);
Seeds dicom_codestream_seeds();

// A sound CT slice at that height, whose only frame is the codestream.
std::string dicom_around(const std::string& syntax, const std::string& codestream, double z_mm);

}  // namespace organbake
