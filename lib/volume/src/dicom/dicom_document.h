// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vtkDICOMItem.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMValue.h>
#include <vtkNew.h>

#include <filesystem>
#include <string>

#include "dicom/inflated_dicom.h"
#include "organbake/volume/dicom_slice.h"

namespace organbake {

// All data elements of one DICOM file but its pixels, of which it knows where they begin.
class DicomDocument {
 public:
  // Throws BadDataError for a file that is damaged.
  explicit DicomDocument(const std::filesystem::path& file);

  vtkDICOMMetaData& data() const { return *data_; }
  std::string text(vtkDICOMTag tag) const;
  // Of the pixels' first byte, in `readable`, and their number.
  std::uint64_t pixel_offset() const { return pixel_offset_; }
  std::uint32_t pixel_bytes() const { return pixel_bytes_; }
  const std::filesystem::path& readable() const { return readable_.path(); }

 private:
  ReadableDicom readable_;
  vtkNew<vtkDICOMMetaData> data_;
  std::uint64_t pixel_offset_ = 0;
  std::uint32_t pixel_bytes_ = 0;
};

// Where one frame of a file lies, how its values are scaled and what tells it apart from others:
// its own functional groups say it, those that all frames share, or the file.
void read_frame(vtkDICOMMetaData& data, int frame, DicomSlice& slice);

// A value's text without the spaces that pad it.
std::string dicom_text(const vtkDICOMValue& value);

}  // namespace organbake
