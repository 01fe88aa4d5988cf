// SPDX-License-Identifier: GPL-3.0-or-later
// One DICOM file as vtk-dicom reads it.
#pragma once

#include <vtkDICOMItem.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMValue.h>
#include <vtkNew.h>
#include <filesystem>
#include <string>

#include "dicom/dicom.h"

class vtkAlgorithm;
class vtkCallbackCommand;
class vtkCommand;
class vtkObject;

namespace organbake {

// VTK reports errors as events and prints them when nobody listens. This listens: what the watched
// objects say is kept, and the caller turns it into a BadDataError. (Parsers
// deep inside VTK can still write to VTK's process-wide log.)
class VtkErrorLog {
 public:
  VtkErrorLog();
  ~VtkErrorLog();
  VtkErrorLog(const VtkErrorLog&) = delete;
  VtkErrorLog& operator=(const VtkErrorLog&) = delete;

  // Watches the algorithm and its executive, which reports a failed request in its own name.
  void watch(vtkAlgorithm* algorithm);
  // Watches an object outside any pipeline.
  void watch_object(vtkObject* object);
  // For readers that take an observer for their inner parser (vtkXMLReader).
  vtkCommand* observer() const;

  bool empty() const { return first_.empty(); }
  // The first error's own words, without VTK's file, line and address; empty when there was none.
  const std::string& first() const { return first_; }
  // Throws BadDataError with the first error, if there was one.
  void throw_if_any(const std::filesystem::path& file) const;

 private:
  static void remember(vtkObject* caller, unsigned long event, void* log, void* text);

  vtkCallbackCommand* observer_;
  std::string first_;
};

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
