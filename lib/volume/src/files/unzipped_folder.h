// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "organbake/core/temporary_folder.h"

namespace organbake {

bool starts_zip(std::string_view first_bytes);

// The files of a zip, side by side in a folder that goes with this object, whatever folders they
// were in: what a PACS or a browser packs a series into. Folders, macOS's companions (__MACOSX,
// ._…) and empty files are left out. Throws BadDataError naming the zip: damaged, encrypted, of too
// many files, or larger than any scan when unpacked.
class UnzippedFolder {
 public:
  explicit UnzippedFolder(const std::filesystem::path& zip);

  // The folder, or its only file.
  const std::filesystem::path& path() const { return path_; }
  // A message about something in it, as one about the zip.
  std::string about_the_zip(const std::string& message) const;

 private:
  std::filesystem::path zip_, path_;
  TemporaryFolder folder_;
};

}  // namespace organbake
