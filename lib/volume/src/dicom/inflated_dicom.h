// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

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

}  // namespace organbake
