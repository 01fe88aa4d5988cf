// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "organbake/core/error.h"

namespace organbake {

// An empty folder of its own for a test or a measurement, removed with everything in it.
class TemporaryFolder {
 public:
  // Throws IoError when the system's temporary folder takes none.
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "organbake-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw IoError::writing(name, std::strerror(errno));
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;  // what cannot be removed is the system's to clear
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace organbake
