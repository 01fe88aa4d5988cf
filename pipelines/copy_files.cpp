// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/copy_files.h"

#include "core/error.h"
#include "core/files.h"

namespace organbake {
namespace fs = std::filesystem;

void make_folder_of(const fs::path& file) {
  if (file.has_parent_path()) make_folder(file.parent_path());
}

void copy_into(const fs::path& from, const fs::path& to) {
  make_folder_of(to);
  std::error_code error;
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, error);
  if (error) throw IoError::writing(to, "cannot be copied here: " + error.message());
}

}  // namespace organbake
