// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/copy_files.h"

#include "core/error.h"

namespace organbake {
namespace fs = std::filesystem;

void copy_into(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to.parent_path(), error);
  if (!error) fs::copy_file(from, to, fs::copy_options::overwrite_existing, error);
  if (error) throw IoError::writing(to, "cannot be copied here: " + error.message());
}

}  // namespace organbake
