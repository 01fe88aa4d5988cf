// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_document.h"

#include <algorithm>

#include "dicom/dicom_masks.h"
#include "dicom/dicom_structure.h"
#include "dicom/vtk_error_log.h"
#include "files/header_text.h"
#include "organbake/core/error.h"

namespace organbake {

DicomDocument::DicomDocument(const std::filesystem::path& file) : readable_(file) {
  if (const std::string flaw = flaw_of_dicom(readable_.path()); !flaw.empty())
    throw BadDataError(file, flaw);
  vtkNew<vtkDICOMParser> parser;
  VtkErrorLog errors;
  errors.watch_object(parser);
  parser->SetMetaData(data_);
  parser->SetFileName(readable_.path().c_str());
  parser->Update();
  errors.throw_if_any(file);
  pixel_offset_ = static_cast<std::uint64_t>(std::max<vtkTypeInt64>(0, parser->GetFileOffset()));
  pixel_bytes_ = parser->GetPixelDataFound() ? parser->GetPixelDataVL() : 0;
}

std::string DicomDocument::text(vtkDICOMTag tag) const { return dicom_text(data_->Get(tag)); }

std::string dicom_text(const vtkDICOMValue& value) { return trimmed(value.AsString()); }

DicomMaskKind dicom_mask_kind(const std::filesystem::path& file) {
  vtkNew<vtkDICOMMetaData> data;
  vtkNew<vtkDICOMParser> parser;
  VtkErrorLog errors;
  errors.watch_object(parser);
  const ReadableDicom readable(file);
  if (!flaw_of_dicom(readable.path()).empty()) return DicomMaskKind::none;
  parser->SetMetaData(data);
  parser->SetFileName(readable.path().c_str());
  parser->Update();
  const std::string kind = dicom_text(data->Get(DC::SOPClassUID));
  if (kind == "1.2.840.10008.5.1.4.1.1.66.4" || kind == "1.2.840.10008.5.1.4.1.1.66.7") {
    return DicomMaskKind::segmentation;
  }
  return kind == "1.2.840.10008.5.1.4.1.1.481.3" ? DicomMaskKind::contours : DicomMaskKind::none;
}

}  // namespace organbake
