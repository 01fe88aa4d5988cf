// SPDX-License-Identifier: GPL-3.0-or-later
// One DICOM file as vtk-dicom reads it.
#pragma once

#include <vtkDICOMItem.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMValue.h>
#include <vtkNew.h>
#include <filesystem>
#include <string>

#include "dicom/dicom.h"

namespace organbake {

// A DICOM file as vtk-dicom's parser can read it. It does not know the deflated transfer syntax
// (PS3.5, A.5): such a file is inflated into memory that has a path as long as this object lives,
// any other is left where it is.
class ReadableDicom {
 public:
  // A file that cannot be inflated stays as it is, and the parser finds fault with it.
  explicit ReadableDicom(const std::filesystem::path& file);
  ~ReadableDicom();
  ReadableDicom(const ReadableDicom&) = delete;
  ReadableDicom& operator=(const ReadableDicom&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int memory_ = -1;  // descriptor of the inflated copy
};

// All data elements of one DICOM file but its pixels, of which it knows where they begin.
class DicomDocument {
 public:
  // Throws nothing for what is in the file: of one that is damaged fault() tells what is wrong.
  explicit DicomDocument(const std::filesystem::path& file);

  const std::string& fault() const { return fault_; }
  // Throws BadDataError for a file that is damaged.
  void check() const;
  vtkDICOMMetaData& data() const { return *data_; }
  std::string text(vtkDICOMTag tag) const;
  // Of the pixels' first byte, in `readable`, and their number; 0 = there are none.
  std::uint64_t pixel_offset() const { return pixel_offset_; }
  std::uint32_t pixel_bytes() const { return pixel_bytes_; }
  const std::filesystem::path& readable() const { return readable_.path(); }

 private:
  std::filesystem::path file_;
  ReadableDicom readable_;
  std::string fault_;
  vtkNew<vtkDICOMMetaData> data_;
  std::uint64_t pixel_offset_ = 0;
  std::uint32_t pixel_bytes_ = 0;
};

// Where one frame of a file lies, how its values are scaled and what tells it apart from others:
// its own functional groups say it, those that all frames share, or the file.
void read_frame(vtkDICOMMetaData& data, int frame, DicomSlice& slice);

// A value's text without the blanks that pad it.
std::string dicom_text(const vtkDICOMValue& value);

// The first bytes of a file, as many as there are; none of one that cannot be read.
std::string beginning_of(const std::filesystem::path& file, std::size_t bytes);

}  // namespace organbake
