// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "organbake/volume/dicom_folder.h"

namespace organbake {

// The images of one SeriesInstanceUID, sorted out.
struct DicomSeries {
  std::string uid, number, description, modality;
  std::size_t images = 0;          // all of them
  std::vector<DicomSlice> slices;  // those that can form one CT volume: alike in size and direction
  std::vector<std::string> passed_over;  // "2 localizers (a.dcm, b.dcm)"
  std::string unfit;                     // why it gives no CT volume; empty when it does

  bool fit() const { return unfit.empty(); }
  std::string name() const;  // series 3 "Abdomen"
  std::string line() const;  // name, images, modality, UID, and what speaks against it
};

// All series of a folder, by series number.
std::vector<DicomSeries> list_series(const DicomFolder& folder);

// The series of this UID or number, or, when `wanted` is empty, the one that is a CT volume; of
// several the one with most slices. What was chosen among others, why, and all that was passed over
// goes into `warnings`. Throws BadDataError when there is no such series or none gives a CT volume.
DicomSeries choose_series(const DicomFolder& folder, const std::string& wanted,
                          std::vector<std::string>& warnings);

}  // namespace organbake
