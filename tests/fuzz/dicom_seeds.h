// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fuzz/readers.h"

namespace organbake {

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
