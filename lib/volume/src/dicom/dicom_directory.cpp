// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_directory.h"

#include <vtkDICOMItem.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMValue.h>
#include <vtkNew.h>

#include <array>
#include <fstream>
#include <string>
#include <string_view>

#include "dicom/dicom_structure.h"
#include "dicom/vtk_error_log.h"
#include "files/header_text.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDirectoryStorage = "1.2.840.10008.1.3.10";

// As a copy of the disc may have it: in any case, with a version behind.
bool same_name(const std::string& listed, std::string found) {
  found = found.substr(0, found.find(';'));
  return lower_case(listed) == lower_case(found);
}

fs::path entry_of(const fs::path& folder, const std::string& name) {
  std::error_code error;
  if (fs::exists(folder / name, error)) return folder / name;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (same_name(name, entry.path().filename().string())) return entry.path();
  }
  return {};
}

}  // namespace

bool is_dicom_directory(const fs::path& file) {
  // The meta group, of a few hundred bytes, names what the file is.
  std::array<char, 512> first{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(first.data(), first.size());
  const std::string_view bytes(first.data(), static_cast<std::size_t>(stream.gcount()));
  if (bytes.size() < 132 || bytes.substr(128, 4) != "DICM") return false;
  const std::size_t at = bytes.find(kDirectoryStorage);
  if (at == std::string_view::npos) return false;
  // UIDs of images begin alike: 1.2.840.10008.1.3.10 must end there.
  const char next =
      at + kDirectoryStorage.size() < bytes.size() ? bytes[at + kDirectoryStorage.size()] : '\0';
  return next != '.' && !(next >= '0' && next <= '9');
}

std::vector<fs::path> images_of_directory(const fs::path& file) {
  if (const std::string flaw = flaw_of_dicom(file); !flaw.empty()) throw BadDataError(file, flaw);
  vtkNew<vtkDICOMMetaData> data;
  vtkNew<vtkDICOMParser> parser;
  VtkErrorLog errors;
  errors.watch_object(parser);
  parser->SetMetaData(data);
  parser->SetFileName(file.c_str());
  parser->Update();
  errors.throw_if_any(file);
  std::vector<fs::path> images;
  const vtkDICOMValue& records = data->Get(DC::DirectoryRecordSequence);
  for (std::size_t i = 0; i < records.GetNumberOfValues(); ++i) {
    const vtkDICOMValue& parts = records.GetItem(i).Get(DC::ReferencedFileID);
    fs::path image;
    for (std::size_t part = 0; part < parts.GetNumberOfValues(); ++part) {
      const std::string name = trimmed(parts.GetString(part));
      // A directory lists what lies below it, and nothing else.
      if (name == ".." || name.find('/') != std::string::npos) {
        throw BadDataError(file, "lists \"" + name + "\", which is no name of a file");
      }
      image /= name;
    }
    if (!image.empty()) images.push_back(image);
  }
  if (images.empty()) throw BadDataError(file, "is a DICOM directory that lists no image");
  return images;
}

fs::path as_on_disc(const fs::path& root, const fs::path& listed) {
  fs::path found = root.empty() ? fs::path(".") : root;
  for (const fs::path& part : listed) {
    found = entry_of(found, part.string());
    if (found.empty()) return {};
  }
  return found;
}

}  // namespace organbake
